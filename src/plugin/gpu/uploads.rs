//! Upload of rectangles into GPU textures that exist.
//!
//! The texels on the CPU (`Image::data`) are the truth. Painting changes them without an asset event, notes the
//! rectangle here and packs its texels, while the cache still has them, the way the GPU wants them; the extraction, which
//! sees both worlds, puts them where the GPU reads them. The commands to copy them into the textures are made beside the
//! renderer's preparations. Whatever else makes the renderer prepare an image again uploads all of `data`,
//! cracks included.

use super::buffer::{Packed, Staged, Stager};
use super::pack::{Changed, Memory, Packer};
use crate::raster::TexelRect;
use bevy::{platform::collections::HashMap, prelude::*, render::renderer::RenderDevice};
use std::sync::Arc;

/// Above this many rectangles that nobody fetches, or that were fetched and wait, the one around them all is uploaded of each image.
const MAX_UNFETCHED: usize = 1024;

const MAX_WAITING: usize = 1 << 16;

/// Rectangles to upload.
#[derive(Resource, Default)]
pub(crate) struct Uploads {
    /// Whether there is a renderer that fetches them.
    pub(super) is_wanted: bool,
    pub(super) rects: Vec<Changed>,
    pub(super) packers: Vec<Packer>,
    /// Where the texels of `rects` are packed that are: from the renderer, which is done with it.
    pub(super) packed: Option<Packed>,
    /// Number of rectangles up to which they are not thinned out again.
    limit: usize,
    /// How many of `rects` have been followed up in the mip levels of their images.
    pub(super) levelled: usize,
    /// Whether the renderer has fetched them since they were last looked at.
    pub(super) is_fetched: bool,
    /// Whether whole textures are on their way.
    pub(super) has_whole: bool,
    /// Pictures, or parts of them, that come before the rectangles.
    pub(super) staged: Vec<(AssetId<Image>, Staged)>,
}

impl Uploads {
    /// Notes that a surface shows a texture from this frame on that the GPU does not have yet. Were it to wait for its turn under
    /// [`RenderAssetBytesPerFrame`](bevy::render::render_asset::RenderAssetBytesPerFrame), the surface would vanish
    /// meanwhile: the limit does not hold in this frame.
    pub(crate) fn expect_whole(&mut self) {
        self.has_whole = self.is_wanted;
    }

    /// Notes that texels of an image have changed.
    pub(crate) fn push(&mut self, image: AssetId<Image>, rect: TexelRect) {
        self.push_level(image, 0, rect);
    }

    /// Notes that texels of one of its mip levels have changed.
    pub(crate) fn push_level(&mut self, image: AssetId<Image>, level: u32, rect: TexelRect) {
        if self.is_wanted && !rect.is_empty() {
            self.rects.push(Changed { image, level, rect, place: None });
        }
    }

    /// Notes for a copy of an image what has changed in that in this frame: its mip levels have not followed yet, and neither have those of
    /// the copy.
    pub(crate) fn push_copy(&mut self, image: AssetId<Image>, copy: AssetId<Image>) {
        let fresh = self.rects.get(self.levelled..).unwrap_or_default().iter();
        let fresh = fresh.filter(|changed| changed.image == image && changed.level == 0).map(|changed| changed.rect);
        fresh.collect::<Vec<_>>().into_iter().for_each(|rect| self.push(copy, rect));
    }

    /// The rectangles that nobody has fetched yet.
    #[cfg(feature = "editor")]
    pub(crate) fn changed(&self) -> impl Iterator<Item = (AssetId<Image>, TexelRect)> + '_ {
        self.rects.iter().filter(|changed| changed.level == 0).map(|changed| (changed.image, changed.rect))
    }

    /// Lends some packers to `paint`, and takes what they have packed, one after the other. What they have no room for is packed when
    /// the renderer fetches it.
    pub(crate) fn pack(&mut self, count: usize, paint: impl FnOnce(&mut [Packer])) {
        let memory = self.packed.as_ref().map(|packed| packed.memory.clone());
        self.lend(count, memory.as_ref());
        paint(&mut self.packers[..count]);
        self.packers.iter_mut().for_each(|packer| self.rects.append(&mut packer.rects));
    }

    pub(super) fn lend(&mut self, count: usize, memory: Option<&Arc<Memory>>) {
        let is_wanted = self.is_wanted;
        let known = self.packers.len().max(count);
        self.packers.resize_with(known, || Packer::new(is_wanted));
        self.packers[..count].iter_mut().for_each(|packer| packer.lend(memory));
    }

    /// Takes what is packed, so that nobody writes to it any more.
    pub(super) fn close(&mut self) -> Option<Packed> {
        self.packers.iter_mut().for_each(Packer::close);
        self.packed.take()
    }

    /// What brings whole pictures to the renderer, if there is one.
    pub(crate) fn stager(&self, device: Option<&RenderDevice>) -> Option<Stager> {
        // In a browser the device stays on its thread.
        let device = device.filter(|_| self.is_wanted && !cfg!(target_arch = "wasm32"))?;
        Some(Stager::new(device))
    }

    /// Notes that all of an image has changed to what is staged, if it is.
    pub(crate) fn push_whole(&mut self, image: AssetId<Image>, size: UVec2, staged: Option<Staged>) {
        self.staged.retain(|(other, _)| *other != image);
        self.push_staged(image, size, &[TexelRect::whole(size)], staged);
    }

    /// The same of parts of an image.
    pub(crate) fn push_staged(
        &mut self,
        image: AssetId<Image>,
        size: UVec2,
        rects: &[TexelRect],
        staged: Option<Staged>,
    ) {
        // What is packed is older, and would come after it.
        self.rects.iter_mut().filter(|changed| changed.image == image).for_each(|changed| changed.place = None);
        match staged {
            // Nobody fetches them: no more are kept.
            Some(_) if self.is_staged(image) => self.push_whole(image, size, None),
            Some(staged) if self.is_wanted => self.staged.push((image, staged)),
            _ => rects.iter().for_each(|rect| self.push(image, *rect)),
        }
    }

    /// Whether all of an image waits for its upload.
    pub(crate) fn is_staged(&self, image: AssetId<Image>) -> bool {
        self.staged.iter().any(|(other, _)| *other == image)
    }

    /// Replaces the rectangles of each level of an image by the one around them.
    fn thin_out(&mut self) {
        let mut places = HashMap::<(AssetId<Image>, u32), usize>::default();
        let mut thin = Vec::<Changed>::new();
        for Changed { image, level, rect, .. } in self.rects.drain(..) {
            match places.get(&(image, level)) {
                Some(place) => thin[*place].rect = thin[*place].rect.union(rect),
                None => {
                    places.insert((image, level), thin.len());
                    thin.push(Changed { image, level, rect, place: None });
                }
            }
        }
        self.levelled = thin.len();
        self.rects = thin;
        if let Some(packed) = self.close() {
            self.packed = Some(packed.anew());
        }
    }
}

/// Keeps the list short when the renderer does not fetch it (a minimised window).
pub(crate) fn drop_unwanted(mut uploads: ResMut<Uploads>) {
    let most = if core::mem::take(&mut uploads.is_fetched) { MAX_WAITING } else { MAX_UNFETCHED };
    if uploads.rects.len() > uploads.limit.max(most) {
        uploads.thin_out();
        uploads.limit = 2 * uploads.rects.len();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_packed_gives_way_to_what_comes_later() {
        let ids = [1, 2].map(|n| AssetId::Uuid { uuid: bevy::asset::uuid::Uuid::from_u128(n) });
        let size = UVec2::new(20, 10);
        let data = vec![7; 800];
        let rect = |x| TexelRect { min: UVec2::new(x, 2), max: UVec2::new(x + 3, 6) };
        let mut uploads = Uploads { is_wanted: true, ..default() };
        let fill = |uploads: &mut Uploads| {
            uploads.lend(2, Some(&super::super::pack::tests::memory(1 << 18).0));
            uploads.pack(2, |packers| {
                for (packer, x) in packers.iter_mut().zip([4, 9]) {
                    packer.push(ids.into_iter().map(|id| Some((id, &data[..], 4))), size, rect(x));
                }
            });
        };
        let packed = |uploads: &Uploads, id| -> Vec<bool> {
            let changed = uploads.rects.iter().filter(|changed| changed.image == id);
            changed.map(|changed| changed.place.is_some()).collect()
        };
        fill(&mut uploads);
        uploads.push_whole(ids[0], size, None);
        assert_eq!(packed(&uploads, ids[0]), [false, false, false], "older than the whole");
        assert_eq!(packed(&uploads, ids[1]), [true, true]);
        // Thinned out: one rectangle of each image around all of its own, packed when it is fetched.
        fill(&mut uploads);
        uploads.thin_out();
        assert_eq!(uploads.rects.len(), 2);
        for (changed, around) in uploads.rects.iter().zip([TexelRect::whole(size), rect(4).union(rect(9))]) {
            assert!(changed.rect == around && changed.place.is_none(), "{:?}", changed.rect);
        }
    }

    #[test]
    fn only_what_nobody_fetches_is_thinned_out() {
        for is_fetched in [true, false] {
            let mut app = App::new();
            app.init_resource::<Uploads>().add_systems(Update, drop_unwanted);
            let mut uploads = app.world_mut().resource_mut::<Uploads>();
            (uploads.is_wanted, uploads.is_fetched) = (true, is_fetched);
            for x in 0..=MAX_UNFETCHED as u32 {
                let min = UVec2::new(x, 0);
                uploads.push(AssetId::default(), TexelRect { min, max: min + 1 });
            }
            app.update();
            let left = app.world().resource::<Uploads>().rects.len();
            assert_eq!(left, if is_fetched { MAX_UNFETCHED + 1 } else { 1 });
        }
    }

    /// Faults E4 and E5: without a renderer, and with one that has no adapter, nothing waits for one, however much is painted.
    #[cfg(all(feature = "2d", feature = "3d"))]
    #[test]
    fn e5_nothing_waits_for_a_renderer_that_is_not_there() {
        use crate::plugin::{
            CrackPlugins,
            headless::{self, blank, shown},
            prelude::*,
        };
        use bevy::{
            camera::CameraPlugin,
            core_pipeline::CorePipelinePlugin,
            image::TextureAtlasLayout,
            mesh::MeshPlugin,
            render::{RenderPlugin, settings::WgpuSettings},
            sprite_render::SpriteRenderPlugin,
            time::TimeUpdateStrategy,
            window::ExitCondition,
        };
        use core::time::Duration;

        let budget = CrackBudget { milliseconds: 1e6, ..default() };
        let without_adapter = || {
            let render_creation = WgpuSettings { backends: None, ..default() }.into();
            let windows = WindowPlugin { primary_window: None, exit_condition: ExitCondition::DontExit, ..default() };
            let mut app = App::new();
            app.add_plugins((
                MinimalPlugins,
                TransformPlugin,
                windows,
                AssetPlugin::default(),
                RenderPlugin { render_creation, ..default() },
                ImagePlugin::default(),
                MeshPlugin,
                CameraPlugin,
                CorePipelinePlugin,
                SpriteRenderPlugin,
                CrackPlugins,
            ))
            .init_asset::<TextureAtlasLayout>()
            .init_asset::<ColorMaterial>()
            .init_asset::<StandardMaterial>()
            .insert_resource(budget.clone());
            while app.plugins_state() == bevy::app::PluginsState::Adding {
                bevy::tasks::tick_global_task_pools_on_main_thread();
            }
            app.finish();
            app.cleanup();
            app
        };
        for mut app in [headless::app(budget.clone()), without_adapter()] {
            app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_millis(20)));
            let image = app.world_mut().resource_mut::<Assets<Image>>().add(blank(UVec2::splat(64)));
            let entity = app.world_mut().spawn((Sprite::from_image(image), CrackSurface::default())).id();
            app.update();
            let (mut changes, mut before) = (0, shown(&app, entity));
            for i in 0..60u8 {
                if i % 10 == 0 {
                    let at = Vec2::new(0.1 + f32::from(i) / 70.0, 0.5);
                    app.world_mut().trigger(CrackHit::uv(entity, at));
                }
                app.update();
                let now = shown(&app, entity);
                changes += usize::from(now != before);
                before = now;
                let uploads = app.world().resource::<Uploads>();
                assert!(uploads.rects.is_empty() && uploads.staged.is_empty() && uploads.packed.is_none());
                assert!(uploads.packers.iter().all(|packer| packer.rects.is_empty()));
                assert!(!uploads.has_whole && !uploads.is_wanted && uploads.stager(None).is_none());
            }
            assert!(changes > 5, "{changes} frames have painted something");
        }
    }
}
