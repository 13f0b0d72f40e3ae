//! Limits that hold for all surfaces together.

use crate::support::*;
use bevy::prelude::*;
use bevy_crack::prelude::*;

/// Bytes of all images.
fn bytes(app: &App) -> u64 {
    let images = app.world().resource::<Assets<Image>>();
    images.iter().map(|(_, image)| image.data.as_ref().map_or(0, Vec::len) as u64).sum()
}

/// Ten times as many surfaces are hit as there is memory for: it is never exceeded, each surface cracks or says why not, and what others
/// give back is there for the next, which cracks then as it would have at first.
#[test]
fn b1_ten_times_the_memory() {
    const BUDGET: u64 = 2_000_000;
    let mut app = app();
    *app.world_mut().resource_mut::<CrackBudget>() =
        CrackBudget { milliseconds: 1e6, max_texture_bytes: BUDGET, ..default() };
    let image = add(&mut app, picture(UVec2::splat(128)));
    let base = bytes(&app);
    let surfaces: Vec<Entity> = (0..60)
        .map(|i| {
            let surface = CrackSurface::new(small_preset()).with_seed(i);
            app.world_mut().spawn((Sprite::from_image(image.clone()), surface, ShatterCracks::default())).id()
        })
        .collect();
    let mut first = None;
    for round in 0..2 {
        for entity in &surfaces {
            hit(&mut app, center(*entity));
            step(&mut app);
            assert!(bytes(&app) - base <= BUDGET, "{} of {BUDGET} bytes", bytes(&app) - base);
        }
        steps(&mut app, 60);
        assert!(bytes(&app) - base <= BUDGET);
        let (mut cracked, mut coarse, mut refused) = (0, 0, 0);
        for entity in &surfaces {
            match state(&app, *entity).status {
                CrackStatus::Done => {
                    assert!(state(&app, *entity).nodes > 0);
                    let own = app.world().resource::<Assets<Image>>().get(&image_of(&app, *entity)).expect("it").size();
                    cracked += 1;
                    coarse += usize::from(own != UVec2::splat(128));
                }
                CrackStatus::Failed(CrackError::TextureBudget { needed, left }) => {
                    assert!(needed > left);
                    refused += 1;
                }
                other => panic!("{other:?}"),
            }
        }
        assert!(cracked >= 4 && coarse > 0 && refused >= 30, "{cracked} {coarse} {refused}");
        // There is no more for their shards.
        app.world_mut().commands().entity(surfaces[0]).shatter_cracks(ShatterRequest::ALL);
        steps(&mut app, 3);
        assert!(bytes(&app) - base <= BUDGET);
        let shows = shown(&app, surfaces[1]);
        assert!(*first.get_or_insert_with(|| shows.clone()) == shows, "round {round}");
        // One that was refused has its turn when others are healed.
        for entity in &surfaces[..30] {
            app.world_mut().commands().entity(*entity).heal_cracks();
        }
        steps(&mut app, 2);
        let last = surfaces[59];
        hit(&mut app, center(last));
        settle(&mut app, last);
        assert!(state(&app, last).nodes > 0);
        let own = app.world().resource::<Assets<Image>>().get(&image_of(&app, last)).expect("it").size();
        assert_eq!(own, UVec2::splat(128), "at full size");
        for entity in &surfaces {
            app.world_mut().commands().entity(*entity).heal_cracks();
        }
        wait_for(&mut app, "all of the memory", |app| bytes(app) == base);
    }
}
