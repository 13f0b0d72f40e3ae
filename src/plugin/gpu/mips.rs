//! The mip levels of textures follow what is painted.

use crate::paint::MipLevels;
use crate::plugin::gpu::textures;
use crate::plugin::gpu::uploads::Uploads;
use crate::plugin::jobs::frame_time::par_for_each;
use crate::raster::TexelRect;
use bevy::{platform::collections::HashMap, prelude::*};

/// A texture whose levels are to follow.
struct Followed {
    image: AssetId<Image>,
    levels: MipLevels,
    texels: Vec<u8>,
    rects: Vec<TexelRect>,
    changed: Vec<(u32, TexelRect)>,
}

/// Brings the mip levels of textures up to date where texels have changed in this frame, as many textures at once as there are threads. What tasks make
/// has its levels already.
pub(crate) fn follow_up(mut uploads: ResMut<Uploads>, images: Option<ResMut<Assets<Image>>>) {
    let fresh = uploads.levelled;
    let Some(mut images) = images.filter(|_| uploads.rects.len() > fresh) else { return };
    let mut rects = HashMap::<AssetId<Image>, Vec<TexelRect>>::default();
    for changed in uploads.rects.get(fresh..).unwrap_or_default() {
        let has_mips = |image: &Image| image.texture_descriptor.mip_level_count > 1;
        if changed.level == 0 && images.get(changed.image).is_some_and(has_mips) {
            rects.entry(changed.image).or_default().push(changed.rect);
        }
    }
    let mut followed: Vec<_> = rects.into_iter().filter_map(|(image, rects)| take(&mut images, image, rects)).collect();
    par_for_each(followed.iter_mut(), |one| one.changed = one.levels.update(&mut one.texels, &one.rects));
    for Followed { image, texels, changed, .. } in followed {
        if let Some(image) = images.get_mut_untracked(image) {
            image.data = Some(texels);
        }
        changed.into_iter().for_each(|(level, rect)| uploads.push_level(image, level, rect));
    }
    uploads.levelled = uploads.rects.len();
}

/// Takes the texels out of their image: many cannot be borrowed at once. Without an asset event, which would upload all of it.
fn take(images: &mut Assets<Image>, image: AssetId<Image>, rects: Vec<TexelRect>) -> Option<Followed> {
    let texture = images.get_mut_untracked(image)?;
    let levels = textures::levels(texture)?;
    Some(Followed { image, levels, texels: texture.data.take()?, rects, changed: Vec::new() })
}

#[cfg(all(test, feature = "2d"))]
mod tests {
    use super::*;
    use crate::shatter::{Anchor, ShatterParams};
    use crate::{
        Grid,
        math::Rng,
        paint::TexelKind,
        plugin::{
            headless::{app, blank},
            prelude::*,
        },
    };
    use bevy::time::TimeUpdateStrategy;
    use core::time::Duration;

    /// All textures that have mip levels, and texels yet.
    fn with_mips(app: &App) -> Vec<&Image> {
        let images = app.world().resource::<Assets<Image>>().iter();
        images
            .map(|(_, image)| image)
            .filter(|image| image.texture_descriptor.mip_level_count > 1 && image.data.is_some())
            .collect()
    }

    /// Levels are those of the texels there are, as if made anew.
    fn assert_levels(app: &App, what: &str) {
        for image in with_mips(app) {
            let (size, levels) =
                (image.size(), textures::levels(image).unwrap_or(MipLevels::new(UVec2::ZERO, TexelKind::Single)));
            assert_eq!(image.texture_descriptor.mip_level_count, levels.count());
            let texels = image.data.as_deref().unwrap_or_default();
            assert_eq!(texels.len(), levels.bytes());
            let mut anew = texels.to_vec();
            levels.update(&mut anew, &[TexelRect::whole(size)]);
            assert!(anew == texels, "{what}: {size} {:?}", image.texture_descriptor.format);
        }
    }

    /// In each frame of random operations, on surfaces that frames paint, and on those that tasks do.
    #[test]
    fn levels_follow_whatever_happens() {
        for (size, no_threads) in [([100, 61], false), ([600, 470], false), ([600, 470], true)] {
            let mut app = app(CrackBudget::default());
            app.world_mut().resource_mut::<Uploads>().is_wanted = true;
            app.world_mut().resource_mut::<crate::plugin::jobs::threads::Threads>().are_missing = no_threads;
            app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_millis(50)));
            let image = app.world_mut().resource_mut::<Assets<Image>>().add(blank(UVec2::from(size)));
            let surface = CrackSurface::new(CrackPreset::GLASS).with_mips(CrackMips::Always);
            let cut = ShatterParams { extend_cracks: true, ..ShatterParams::DEFAULT };
            let shatter = ShatterCracks { cut, anchor: Anchor::Nothing, ..default() };
            let entity =
                app.world_mut().spawn((Sprite::from_image(image), surface, shatter, CrackClock::default())).id();
            let mut rng = Rng::new(7);
            let (mut frame, mut most, mut shards) = (0_usize, 0, 0);
            while frame < 160 || (frame < 4000 && (most < 3 || shards == 0)) {
                if frame >= 160 {
                    // Tasks take their time.
                    std::thread::sleep(Duration::from_millis(1));
                }
                let at = Vec2::new(rng.unit(), rng.unit());
                let doing = if frame == 0 { 0 } else { rng.next_u32() % 24 };
                let mut commands = app.world_mut().commands();
                match doing {
                    0..4 => commands.trigger(CrackHit::uv(entity, at).with_energy(3.0 * rng.unit())),
                    4 => _ = commands.entity(entity).shatter_cracks(ShatterRequest::around(at, 0.3)),
                    5 if frame > 100 => _ = commands.entity(entity).heal_cracks(),
                    6 => {
                        let guide = CrackGuide::new(Grid::new(UVec2::new(3, 2), rng.unit()));
                        let appearance = GuidedAppearance::Widen { seconds: 0.3 };
                        commands.entity(entity).insert(GuidedCracks::new(guide).with_appearance(appearance));
                    }
                    7 => {
                        let preset = [CrackPreset::GLASS, CrackPreset::TOON][frame % 2].clone();
                        app.world_mut().get_mut::<CrackSurface>(entity).expect("it is there").preset = preset.into();
                    }
                    8 => {
                        let speed = [1.0, -1.0][frame % 2];
                        commands.entity(entity).insert(CrackClock::speed(speed));
                    }
                    _ => {}
                }
                app.update();
                assert_levels(&app, &format!("frame {frame}, after {doing}"));
                most = most.max(with_mips(&app).len());
                shards += app.world().get::<CrackShards>(entity).map_or(0, |shards| shards.shown);
                frame += 1;
            }
            assert!(most >= 3 && shards > 0, "{most} textures, {shards} shards: too little has happened");
        }
    }

    /// By itself a surface has levels if its picture has, and none if it is not to.
    #[test]
    fn levels_are_as_those_of_the_picture() {
        for (has_mips, mips, wanted) in [
            (false, CrackMips::Auto, false),
            (true, CrackMips::Auto, true),
            (true, CrackMips::Never, false),
            (false, CrackMips::Always, true),
        ] {
            let mut app = app(CrackBudget { milliseconds: 1e6, ..default() });
            let mut image = blank(UVec2::new(40, 30));
            if has_mips {
                let levels = textures::levels(&image).expect("a plain format");
                image.texture_descriptor.mip_level_count = levels.count();
                image.data = Some([200, 200, 200, 255].repeat(levels.bytes() / 4));
            }
            let image = app.world_mut().resource_mut::<Assets<Image>>().add(image);
            let surface = CrackSurface::default().with_mips(mips);
            let entity = app.world_mut().spawn((Sprite::from_image(image), surface)).id();
            app.world_mut().trigger(CrackHit::uv(entity, Vec2::splat(0.5)));
            (0..3).for_each(|_| app.update());
            let textures = app.world().get::<CrackTextures>(entity).expect("it has cracked").clone();
            for texture in textures.handles() {
                let image = app.world().resource::<Assets<Image>>().get(texture).expect("its texture");
                assert_eq!(image.texture_descriptor.mip_level_count > 1, wanted, "{has_mips} {mips:?}");
            }
        }
    }
}
