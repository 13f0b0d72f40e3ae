//! Cracks that were carried on when a surface was cut are drawn on it.

use crate::paint::LookTable;
use crate::plugin::api::textures::MAPS;
use crate::plugin::gpu::textures::{self, TextureKind};
use crate::plugin::gpu::uploads::Uploads;
use crate::plugin::jobs::background::drop_in_background;
use crate::plugin::source::analogy::AnalogyPicture;
use crate::plugin::source::picture::BasePicture;
use crate::plugin::surface::active::Active;
use crate::plugin::surface::stamp::stamp_hairlines;
use crate::raster::{DepthField, DirtyTiles, Profile, TexelRect};
use bevy::prelude::*;
use std::sync::Arc;

/// What lines are drawn with in the background.
pub(super) struct Sketch {
    field: DepthField,
    profile: Profile,
    look: LookTable,
    analogy: Option<Arc<AnalogyPicture>>,
    width: f32,
    /// Which textures there are.
    maps: [bool; MAPS],
    view: TexelRect,
    painted: u64,
}

impl Sketch {
    /// `None` if nothing is shown.
    pub(super) fn new(active: &Active) -> Option<Self> {
        let textures = &active.canvas.textures;
        Some(Self {
            field: active.drawing.field.clone(),
            profile: active.drawing.profile,
            look: active.canvas.look.clone(),
            analogy: active.canvas.analogy.clone(),
            width: active.hair(),
            maps: textures.all().map(|texture| texture.is_some()),
            view: active.canvas.views.get(active.canvas.view)?.rect,
            painted: active.drawing.painted,
        })
    }

    /// Draws lines and paints what they change.
    pub(super) fn draw(mut self, lines: &[Vec<Vec2>], base: &BasePicture) -> Drawn {
        let mut rects = Vec::new();
        stamp_hairlines(&mut self.field, &self.profile, self.width, lines, |rect| rects.push(rect));
        let mut dirty = DirtyTiles::new(self.field.frame.size());
        rects.drain(..).for_each(|rect| dirty.mark(self.look.affected(rect, &self.field.depth)));
        dirty.take_rects(&mut rects);
        rects.iter_mut().for_each(|rect| *rect = rect.intersect(TexelRect::whole(self.view.size())));
        rects.retain(|rect| !rect.is_empty());
        let mut kinds = textures::KINDS.iter().zip(self.maps);
        let mut room = || kinds.next().filter(|(_, is)| *is).map(|(kind, _)| vec![0; base.area() * kind.texel()]);
        let mut maps = [(); MAPS].map(|()| room());
        let texels = maps.each_mut().map(Option::as_deref_mut);
        textures::paint(base, self.analogy.as_deref(), &self.field, &self.look, &rects, self.view.min, texels);
        Drawn { sketch: self, rects, maps }
    }
}

/// What was painted in the background.
pub(super) struct Drawn {
    sketch: Sketch,
    /// Texels of the field that have changed.
    rects: Vec<TexelRect>,
    /// The whole textures, with texels in these rectangles only.
    maps: [Option<Vec<u8>>; MAPS],
}

impl Drawn {
    /// Whether the surface still looks as it did.
    pub(super) fn fits(&self, active: &Active) -> bool {
        let view = active.canvas.views.get(active.canvas.view).map(|view| view.rect);
        self.sketch.painted == active.drawing.painted && view == Some(self.sketch.view)
    }

    /// Puts on the surface what was painted.
    pub(super) fn put_on(self, world: &mut World, active: &mut Active) {
        let Self { sketch, rects, maps } = self;
        let (size, origin, shown) = (active.canvas.base.size, sketch.view.min, active.canvas.view);
        for (_, view) in active.canvas.views.iter_mut().enumerate().filter(|(index, _)| *index != shown) {
            rects.iter().for_each(|rect| view.dirty.mark(*rect));
        }
        active.canvas.note_depths(&rects);
        world.resource_scope(|world, mut images: Mut<Assets<Image>>| {
            let mut uploads = world.resource_mut::<Uploads>();
            for ((texture, map), kind) in active.canvas.textures.all().into_iter().zip(&maps).zip(&textures::KINDS) {
                // Without an asset event, which would upload the whole image.
                if let (Some(texture), Some(map)) = (texture, map)
                    && let Some(data) = images.get_mut_untracked(texture).and_then(|image| image.data.as_mut())
                {
                    for rect in &rects {
                        copy(map, data, size, origin, *rect, kind);
                        uploads.push(texture.id(), TexelRect { min: rect.min + origin, max: rect.max + origin });
                    }
                }
            }
            if let (Some(holes), Some(diffuse)) = (&active.drawing.cutouts, &active.canvas.textures.diffuse)
                && let Some(data) = images.get_mut_untracked(diffuse).and_then(|image| image.data.as_mut())
            {
                rects.iter().for_each(|rect| holes.cut_out(data, size, origin, *rect));
            }
        });
        drop_in_background((core::mem::replace(&mut active.drawing.field, sketch.field), maps));
    }
}

/// Copies a rectangle from one texture to another of the same size.
fn copy(from: &[u8], to: &mut [u8], size: UVec2, origin: UVec2, rect: TexelRect, kind: &TextureKind) {
    let length = rect.size().x as usize * kind.texel();
    for y in rect.min.y..rect.max.y {
        let at = origin + UVec2::new(rect.min.x, y);
        let start = (at.y as usize * size.x as usize + at.x as usize) * kind.texel();
        if let (Some(from), Some(to)) = (from.get(start..start + length), to.get_mut(start..start + length)) {
            to.copy_from_slice(from);
        }
    }
}

#[cfg(all(test, feature = "2d"))]
mod tests {
    use crate::plugin::{
        headless::{app, blank},
        prelude::*,
        surface::cracked::active,
    };
    use crate::shatter::{Anchor, ShatterParams};
    use bevy::prelude::*;

    /// Lines that shards carry on have depths too: whoever blends normals from depths hears of them.
    #[test]
    fn lines_that_are_carried_on_are_new_depths() {
        let mut app = app(CrackBudget { milliseconds: f32::INFINITY, ..default() });
        let image = app.world_mut().resource_mut::<Assets<Image>>().add(blank(UVec2::splat(128)));
        let cut = ShatterParams { extend_cracks: true, ..ShatterParams::DEFAULT };
        let settings = ShatterCracks { cut, anchor: Anchor::Nothing, speed: 0.0, ..default() };
        let surface = CrackSurface::new(CrackPreset::CONCRETE);
        let entity = app.world_mut().spawn((Sprite::from_image(image), surface, settings)).id();
        app.world_mut().trigger(CrackHit::uv(entity, Vec2::splat(0.4)).with_energy(2.0));
        let revision = |app: &App| active(app.world(), entity).map(|active| active.canvas.revision);
        while app.world().get::<CrackState>(entity).is_none_or(|state| state.status != CrackStatus::Done) {
            app.update();
        }
        app.update();
        let before = revision(&app);
        app.update();
        assert_eq!(revision(&app), before, "at rest");
        app.world_mut().commands().entity(entity).shatter_cracks(ShatterRequest::ALL);
        while app.world().get::<CrackShards>(entity).is_none() {
            app.update();
        }
        assert!(active(app.world(), entity).is_some_and(|active| !active.drawing.carried.is_empty()), "lines go on");
        assert!(revision(&app) > before);
    }
}
