//! What is asked for while a system has surfaces taken out is done when they are back in the world: nothing is skipped.

use bevy::prelude::*;

type Job = Box<dyn FnOnce(&mut World) + Send + Sync>;

/// What waits. Observers and hooks of a game run while shards come and go, while textures are reported and while bakes are committed, and may heal,
/// despawn or shatter any surface then.
#[derive(Resource, Default)]
pub(crate) struct Later {
    /// How many systems have surfaces taken out.
    hands: u32,
    waiting: Vec<Job>,
}

/// Does `work`, which has surfaces taken out while others may ask for something, and then what they have asked for.
pub(crate) fn hold<T>(world: &mut World, work: impl FnOnce(&mut World) -> T) -> T {
    let Some(mut later) = world.get_resource_mut::<Later>() else { return work(world) };
    later.hands += 1;
    let result = work(world);
    let Some(mut later) = world.get_resource_mut::<Later>() else { return result };
    later.hands -= 1;
    if later.hands == 0 {
        for job in core::mem::take(&mut later.waiting) {
            job(world);
        }
    }
    result
}

/// Does a job now, or as soon as no system has surfaces taken out.
pub(crate) fn when_free(world: &mut World, job: impl FnOnce(&mut World) + Send + Sync + 'static) {
    match world.get_resource_mut::<Later>() {
        Some(mut later) if later.hands > 0 => later.waiting.push(Box::new(job)),
        _ => job(world),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Resource, Default)]
    struct Done(Vec<u32>);

    fn note(n: u32) -> impl FnOnce(&mut World) + Send + Sync + 'static {
        move |world| world.resource_mut::<Done>().0.push(n)
    }

    #[test]
    fn what_is_asked_for_meanwhile_comes_after_in_order() {
        let mut world = World::new();
        world.init_resource::<Later>();
        world.init_resource::<Done>();
        when_free(&mut world, note(0));
        let result = hold(&mut world, |world| {
            when_free(world, |world| {
                note(2)(world);
                // Nothing is taken out now.
                hold(world, |world| when_free(world, note(3)));
                when_free(world, note(4));
            });
            hold(world, |world| when_free(world, note(5)));
            note(1)(world);
            7
        });
        assert_eq!((result, &world.resource::<Done>().0), (7, &vec![0, 1, 2, 3, 4, 5]));
        assert!(world.resource::<Later>().waiting.is_empty());
    }
}
