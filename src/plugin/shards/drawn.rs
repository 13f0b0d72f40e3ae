//! Cracks that were carried on when a surface was cut are drawn on it.

use super::ShatterCracks;
use crate::{
    paint::{Look, LookTable},
    pattern::{PathPoint, SegmentPath},
    plugin::{
        beside::throw_away,
        picture::BasePicture,
        surfaces::Active,
        textures::{self, MAPS, TextureKind},
        upload::Uploads,
    },
    raster::{DepthField, DirtyTiles, Profile, TexelRect, stamp_path},
    shatter::RimLook,
};
use bevy::prelude::*;

/// How wide a crack is that was carried on, as a share of the narrowest that grow.
const HAIR: f32 = 0.5;

impl Active {
    /// Draws lines as cracks into the field.
    pub(super) fn stamp_lines(&mut self, lines: &[Vec<Vec2>]) {
        let width = self.hair();
        let mut rects = Vec::new();
        stamp(&mut self.field, &self.profile, width, lines, |rect| rects.push(rect));
        rects.into_iter().for_each(|rect| self.mark(rect));
    }

    fn hair(&self) -> f32 {
        HAIR * self.growth.params().line_width
    }

    /// Draws the cracks that were carried on once more: the field has been drawn anew.
    pub(in crate::plugin) fn stamp_carried(&mut self) {
        if let Some(broken) = self.broken.take() {
            broken.carried.iter().for_each(|lines| self.stamp_lines(lines));
            self.broken = Some(broken);
        }
    }

    /// How the rims of its shards look.
    pub(super) fn rim(&self, settings: &ShatterCracks) -> RimLook {
        rim_for(settings, &self.preset.look)
    }
}

/// How the rims of shards look.
pub(in crate::plugin) fn rim_for(settings: &ShatterCracks, look: &Look) -> RimLook {
    settings.rim.unwrap_or_else(|| rim_of(look))
}

fn stamp(
    field: &mut DepthField,
    profile: &Profile,
    width: f32,
    lines: &[Vec<Vec2>],
    mut changed: impl FnMut(TexelRect),
) {
    for pair in lines.iter().flat_map(|line| line.windows(2)) {
        let [from, to] = [pair[0], pair[1]].map(|pos| PathPoint { pos, width });
        changed(stamp_path(field, profile, &SegmentPath::straight(from, to)));
    }
}

fn rim_of(look: &Look) -> RimLook {
    match look {
        // The picture behind is seen through the walls of the cracks.
        Look { shift, opaque: true, .. } if *shift > 0.0 => RimLook::GLASS,
        // Drawn, or as thin as ink.
        Look { opaque: true, .. } | Look { relief: 0.0, .. } => RimLook::PLAIN,
        _ => RimLook::STONE,
    }
}

/// What lines are drawn with beside the frames.
pub(super) struct Sketch {
    field: DepthField,
    profile: Profile,
    look: LookTable,
    width: f32,
    /// Which textures there are.
    maps: [bool; MAPS],
    view: TexelRect,
    painted: u64,
}

impl Sketch {
    /// `None` if nothing is shown.
    pub(super) fn new(active: &Active) -> Option<Self> {
        let textures = &active.textures;
        Some(Self {
            field: active.field.clone(),
            profile: active.profile,
            look: active.look.clone(),
            width: active.hair(),
            maps: textures.all().map(|texture| texture.is_some()),
            view: active.views.get(active.view)?.rect,
            painted: active.painted,
        })
    }

    /// Draws lines and paints what they change.
    pub(super) fn draw(mut self, lines: &[Vec<Vec2>], base: &BasePicture) -> Drawn {
        let size = self.field.frame.size();
        let mut dirty = DirtyTiles::new(size);
        stamp(&mut self.field, &self.profile, self.width, lines, |rect| dirty.mark(rect.grow(1, size)));
        let mut rects = Vec::new();
        dirty.take_rects(&mut rects);
        rects.iter_mut().for_each(|rect| *rect = rect.intersect(TexelRect::whole(self.view.size())));
        rects.retain(|rect| !rect.is_empty());
        let mut kinds = textures::KINDS.iter().zip(self.maps);
        let mut room = || kinds.next().filter(|(_, is)| *is).map(|(kind, _)| vec![0; base.area() * kind.texel()]);
        let mut maps = [(); MAPS].map(|()| room());
        let texels = maps.each_mut().map(Option::as_deref_mut);
        textures::paint(base, &self.field, &self.look, &rects, self.view.min, texels);
        Drawn { sketch: self, rects, maps }
    }
}

/// What was painted beside the frames.
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
        let view = active.views.get(active.view).map(|view| view.rect);
        self.sketch.painted == active.painted && view == Some(self.sketch.view)
    }

    /// Puts on the surface what was painted.
    pub(super) fn put_on(self, world: &mut World, active: &mut Active) {
        let Self { sketch, rects, maps } = self;
        let (size, origin, shown) = (active.base.size, sketch.view.min, active.view);
        for (_, view) in active.views.iter_mut().enumerate().filter(|(index, _)| *index != shown) {
            rects.iter().for_each(|rect| view.dirty.mark(*rect));
        }
        world.resource_scope(|world, mut images: Mut<Assets<Image>>| {
            let mut uploads = world.resource_mut::<Uploads>();
            for ((texture, map), kind) in active.textures.all().into_iter().zip(&maps).zip(&textures::KINDS) {
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
            if let (Some(broken), Some(diffuse)) = (&active.broken, &active.textures.diffuse)
                && let Some(data) = images.get_mut_untracked(diffuse).and_then(|image| image.data.as_mut())
            {
                rects.iter().for_each(|rect| broken.holes.cut_out(data, size, origin, *rect));
            }
        });
        throw_away((core::mem::replace(&mut active.field, sketch.field), maps));
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
