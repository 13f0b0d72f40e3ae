//! [`Surfaces`]: the surfaces that have been hit.

use super::{
    CrackClock, CrackSurface, CrackTextures,
    carrier::Carrier,
    clock::Playback,
    film::Film,
    freeze::Frozen,
    picture::BasePicture,
    shards::{Broken, Request, Struck},
};
use crate::{
    CrackPreset, Grid,
    growth::CrackGrowth,
    paint::LookTable,
    pattern::{CellTracker, Network},
    raster::{DepthField, DirtyTiles, Profile, Redrawn, TexelRect},
};
use bevy::{asset::UntypedAssetId, ecs::entity::EntityHashMap, platform::collections::HashMap, prelude::*};
use std::{collections::VecDeque, sync::Arc};

/// The most parts of an image that are remembered; one that is forgotten is painted anew when it is shown again.
const MAX_VIEWS: usize = 256;

/// A part of the image that shows the cracks: the whole image, or a frame of an atlas.
pub(super) struct View {
    pub(super) rect: TexelRect,
    /// What is stamped into the field but not painted here yet, in texels of the field.
    pub(super) dirty: DirtyTiles,
}

/// Cracks that have not grown: the result of a bake.
pub(super) struct Added {
    pub(super) network: Network,
    /// See [`CrackGrowth::add_cracks`].
    pub(super) opening: u32,
    /// How many steps of growth they take.
    pub(super) steps: u32,
}

/// A surface that has been hit.
pub(super) struct Active {
    /// The component as it was when it was last looked at.
    pub(super) surface: CrackSurface,
    /// The preset in use; that of the component unless it was refused.
    pub(super) preset: CrackPreset,
    /// Whether the component or the preset has changed and was not taken up yet.
    pub(super) has_new_settings: bool,
    pub(super) growth: CrackGrowth,
    pub(super) field: DepthField,
    pub(super) profile: Profile,
    pub(super) look: LookTable,
    pub(super) base: Arc<BasePicture>,
    pub(super) textures: CrackTextures,
    pub(super) carrier: Carrier,
    /// Pictures that somebody gave it, until they are accepted.
    pub(super) offered: Vec<AssetId<Image>>,
    /// Bytes counted against the budget.
    pub(super) bytes: u64,
    pub(super) views: Vec<View>,
    /// Index of the view that is shown.
    pub(super) view: usize,
    /// Steps of growth a second.
    pub(super) rate: f32,
    /// Steps of growth that are due, with their fraction.
    pub(super) due: f64,
    /// The component, if it has one.
    pub(super) clock: Option<CrackClock>,
    /// While its cracks close: steps a second, backwards.
    pub(super) closing: Option<f64>,
    /// While baked cracks appear without a clock: steps a second.
    pub(super) appearing: Option<f64>,
    pub(super) added: Option<Added>,
    /// Shows other times than the end; `None` = everything that has grown is shown.
    pub(super) playback: Option<Playback>,
    /// What makes those times beside the frames, for baked cracks. While it is at work `field`, `touched` and the playback's replay are
    /// with it, and the surface counts as dirty without being in the list.
    pub(super) film: Option<Box<Film>>,
    pub(super) hits: u32,
    /// What it has forgotten and still shows.
    pub(super) frozen: Option<Frozen>,
    /// Tiles that a crack has touched.
    pub(super) touched: Touched,
    /// Whether it is in a growing list: it grows, or its time passes.
    pub(super) is_growing: bool,
    /// Whether it is in the dirty list.
    pub(super) is_dirty: bool,
    /// Whether a frame had no time to paint it: its growth waits for that.
    pub(super) is_late: bool,
    /// Whether its end has not been told yet.
    pub(super) is_open: bool,
    /// Whether its pictures have changed since they were read.
    pub(super) is_outdated: bool,
    /// The frame in which they were read, by [`Surfaces::frame`].
    pub(super) read_at: u64,
    /// The size that its textures would have if its picture were not shown stretched; `None` if another was asked for.
    pub(super) unstretched: Option<UVec2>,
    /// Nodes that were there when tips were last listed.
    pub(super) tips_from: usize,
    pub(super) cells: CellTracker,
    /// Cells whose closing has been told, with the one that is there from the start.
    pub(super) cells_told: usize,
    /// The last hit.
    pub(super) struck: Option<Struck>,
    /// Nodes of the network and closed cells when shards last fell by themselves.
    pub(super) fell_at: (usize, usize),
    /// How often it has been painted.
    pub(super) painted: u64,
    /// What its shards are made from: another one whenever shards leave or return, or the surface becomes another.
    pub(super) version: Arc<()>,
    /// Its shards and holes; `None` = it is whole.
    pub(super) broken: Option<Box<Broken>>,
}

/// What a surface is made of before it cracks.
pub(super) struct Ground {
    pub(super) surface: CrackSurface,
    pub(super) preset: CrackPreset,
    pub(super) look: LookTable,
    pub(super) base: Arc<BasePicture>,
    pub(super) textures: CrackTextures,
    pub(super) carrier: Carrier,
    pub(super) bytes: u64,
    pub(super) rect: TexelRect,
    pub(super) unstretched: Option<UVec2>,
    pub(super) read_at: u64,
}

impl Active {
    /// A surface whose textures show what is in the field.
    pub(super) fn new(ground: Ground, growth: CrackGrowth, field: DepthField) -> Self {
        let Ground { surface, preset, look, base, textures, carrier, bytes, rect, unstretched, read_at } = ground;
        let frame = field.frame;
        let mut active = Self {
            growth,
            field,
            profile: preset.profile,
            look,
            textures,
            base,
            carrier,
            offered: Vec::new(),
            bytes,
            views: Vec::new(),
            view: 0,
            rate: preset.steps_per_second,
            due: 0.0,
            clock: None,
            closing: None,
            appearing: None,
            added: None,
            playback: None,
            film: None,
            hits: 0,
            touched: Touched::new(frame.size()),
            is_growing: false,
            is_dirty: false,
            is_late: false,
            is_open: false,
            is_outdated: false,
            read_at,
            unstretched,
            frozen: None,
            tips_from: 0,
            cells: CellTracker::new(frame.extent()),
            cells_told: 1,
            struck: None,
            fell_at: (0, 1),
            painted: 0,
            version: Arc::default(),
            broken: None,
            surface,
            preset,
            has_new_settings: false,
        };
        active.show(rect);
        active.views[0].dirty.clear();
        active
    }

    /// Marks texels of the field as changed, in all views.
    pub(super) fn mark(&mut self, rect: TexelRect) {
        // A normal depends on the texels around it.
        let rect = rect.grow(1, self.field.frame.size());
        for view in &mut self.views {
            view.dirty.mark(rect);
        }
    }

    /// Its shards are made from something else from now on.
    pub(super) fn renew(&mut self) {
        self.version = Arc::default();
    }

    /// Keeps what grows from now on out of the holes of the picture and of shards.
    pub(super) fn mind_holes(&mut self) {
        self.growth.set_density(self.density());
    }

    /// Where cracks may go: not over holes.
    pub(super) fn density(&self) -> Option<Grid<f32>> {
        let rect = self.views.get(self.view)?.rect;
        let base = self.surface.alpha_mask.then_some(&*self.base);
        match &self.broken {
            Some(broken) => broken.holes.density(rect, base),
            None => base?.density(rect),
        }
    }

    /// Shows the cracks in `rect` of the image from now on.
    pub(super) fn show(&mut self, rect: TexelRect) {
        let known = self.views.iter().position(|view| view.rect == rect);
        self.view = known.unwrap_or_else(|| {
            let mut dirty = DirtyTiles::new(self.field.frame.size());
            dirty.mark(TexelRect::whole(self.field.frame.size()));
            if self.views.len() >= MAX_VIEWS {
                self.views.remove(0);
            }
            self.views.push(View { rect, dirty });
            self.views.len() - 1
        });
    }
}

/// A set of tiles.
#[derive(Default)]
pub(super) struct Touched {
    tiles: UVec2,
    /// A bit each, row by row, from a new word on in each row.
    bits: Vec<u64>,
    count: u32,
}

impl Touched {
    pub(super) fn new(size: UVec2) -> Self {
        let tiles = UVec2::new(size.x.div_ceil(DirtyTiles::TILE), size.y.div_ceil(DirtyTiles::TILE));
        Self { tiles, bits: vec![0; tiles.x.div_ceil(64) as usize * tiles.y as usize], count: 0 }
    }

    pub(super) fn mark(&mut self, rect: TexelRect) {
        let (min, max) =
            (rect.min / DirtyTiles::TILE, rect.max.map(|end| end.div_ceil(DirtyTiles::TILE)).min(self.tiles));
        for y in min.y..max.y {
            for first in (min.x / 64 * 64..max.x).step_by(64) {
                let (from, to) = (min.x.max(first) - first, (max.x - first).min(64));
                let all = (u64::MAX << from) & (u64::MAX >> (64 - to));
                let word = &mut self.bits[(y * self.tiles.x.div_ceil(64) + first / 64) as usize];
                self.count += (all & !*word).count_ones();
                *word |= all;
            }
        }
    }

    /// Takes up what has been drawn anew.
    pub(super) fn follow(&mut self, redrawn: &Redrawn) {
        redrawn.cleared.iter().for_each(|tile| self.unmark(*tile));
        redrawn.stamped.iter().for_each(|rect| self.mark(*rect));
    }

    /// Takes the one tile `rect` out.
    fn unmark(&mut self, rect: TexelRect) {
        let tile = rect.min / DirtyTiles::TILE;
        if tile.cmplt(self.tiles).all() {
            let word = &mut self.bits[(tile.y * self.tiles.x.div_ceil(64) + tile.x / 64) as usize];
            let bit = 1 << (tile.x % 64);
            self.count -= u32::from(*word & bit != 0);
            *word &= !bit;
        }
    }

    /// Share of tiles in the set, 0..=1.
    pub(super) fn share(&self) -> f32 {
        self.count as f32 / (self.tiles.x * self.tiles.y).max(1) as f32
    }
}

/// The surfaces that have been hit. Systems visit the lists, never the map.
#[derive(Resource, Default)]
pub(super) struct Surfaces {
    pub(super) active: EntityHashMap<Active>,
    /// Surfaces that grow, each once, in turns.
    pub(super) growing: VecDeque<Entity>,
    /// Surfaces that will grow when others have ended.
    pub(super) held: VecDeque<Entity>,
    /// Surfaces whose last hit has markers to lay out, in order; and some that are done.
    pub(super) laying_out: VecDeque<Entity>,
    /// Surfaces to paint, each once, in turns.
    pub(super) dirty: VecDeque<Entity>,
    /// Surfaces whose times are made beside the frames.
    pub(super) filmed: Vec<Entity>,
    /// Surfaces whose components or pictures have changed.
    pub(super) changed: Vec<Entity>,
    /// Surfaces that have shattered.
    pub(super) broken: Vec<Entity>,
    /// Surfaces that are to shatter, in order.
    pub(super) requests: Vec<Request>,
    /// All shards that are shown, the oldest first: entity, surface, and which of its pieces for which time; and some that are not
    /// any more.
    pub(super) shards: VecDeque<(Entity, Entity, [u32; 2])>,
    /// How many more may become entities in this frame.
    pub(super) new_shards: usize,
    /// Who owns a private image, material or mesh.
    pub(super) owners: HashMap<UntypedAssetId, Entity>,
    /// Which surfaces were made from a picture.
    pub(super) sources: HashMap<AssetId<Image>, Vec<Entity>>,
    /// Bytes of all textures.
    pub(super) bytes: u64,
    /// Number of frames so far.
    pub(super) frame: u64,
}

/// The most surfaces that are worked on at once.
const BATCH: usize = 128;

/// Takes the first surfaces out of a line in which each is once, and makes a job of each that is there.
pub(super) fn batch<'a, J>(
    active: &'a mut EntityHashMap<Active>,
    line: &mut VecDeque<Entity>,
    mut job: impl FnMut(Entity, &'a mut Active) -> Option<J>,
) -> Vec<J> {
    let mut entities = [Entity::PLACEHOLDER; BATCH];
    let count = line.len().min(BATCH);
    entities.iter_mut().zip(line.drain(..count)).for_each(|(slot, entity)| *slot = entity);
    let found = active.get_disjoint_mut(entities.each_ref());
    entities.into_iter().zip(found).filter_map(|(entity, active)| job(entity, active?)).collect()
}

impl Surfaces {
    /// Puts a surface that was hit in the line to grow.
    pub(super) fn start_growing(&mut self, entity: Entity) {
        if let Some(active) = self.active.get_mut(&entity) {
            active.is_open = true;
            self.wake(entity);
        }
    }

    /// Puts a surface whose time may pass in the line to grow.
    pub(super) fn wake(&mut self, entity: Entity) {
        if let Some(active) = self.active.get_mut(&entity)
            && !active.is_growing
        {
            active.is_growing = true;
            self.held.push_back(entity);
        }
    }

    /// Puts a surface in the line to be painted.
    pub(super) fn soil(&mut self, entity: Entity) {
        if let Some(active) = self.active.get_mut(&entity)
            && !active.is_dirty
        {
            active.is_dirty = true;
            self.dirty.push_back(entity);
        }
    }

    /// Forgets everything about a surface.
    pub(super) fn remove(&mut self, entity: Entity) -> Option<Active> {
        self.requests.retain(|request| request.entity != entity);
        let active = self.active.remove(&entity)?;
        // Out of the lists at once: if it comes back before its turn, it must not be in them twice.
        if active.is_growing {
            self.growing.retain(|e| *e != entity);
            self.held.retain(|e| *e != entity);
        }
        if active.is_dirty {
            self.dirty.retain(|e| *e != entity);
        }
        self.disown(entity, &active);
        self.bytes -= active.bytes;
        Some(active)
    }

    /// Notes which assets the surface owns and which it was made from.
    pub(super) fn own(&mut self, entity: Entity, active: &Active) {
        self.owners.extend(active.owned().map(|id| (id, entity)));
        for source in active.sources() {
            let users = self.sources.entry(source).or_default();
            if !users.contains(&entity) {
                users.push(entity);
            }
        }
    }

    /// Takes back what [`own`](Self::own) has noted.
    pub(super) fn disown(&mut self, entity: Entity, active: &Active) {
        for id in active.owned() {
            self.owners.remove(&id);
        }
        for source in active.sources() {
            if let Some(users) = self.sources.get_mut(&source) {
                users.retain(|e| *e != entity);
                if users.is_empty() {
                    self.sources.remove(&source);
                }
            }
        }
    }
}

impl Active {
    /// Ids of the pictures it was made from, and of those that it is to be made from.
    fn sources(&self) -> impl Iterator<Item = AssetId<Image>> + '_ {
        self.carrier.sources().chain(self.offered.iter().copied())
    }

    fn owned(&self) -> impl Iterator<Item = UntypedAssetId> + '_ {
        self.textures.handles().map(|handle| handle.id().untyped()).chain(self.carrier.owned())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rng;
    use std::collections::BTreeSet;

    #[test]
    fn touched_tiles_are_those_of_a_set() {
        let mut rng = Rng::new(8);
        let tile = |texel: UVec2| (texel / DirtyTiles::TILE).to_array();
        for size in [[512, 512], [3000, 40], [1, 1], [1040, 2000]].map(UVec2::from) {
            let (mut touched, mut set) = (Touched::new(size), BTreeSet::new());
            for round in 0..200 {
                let mut corner = || UVec2::new(rng.next_u32() % size.x, rng.next_u32() % size.y);
                let (a, b) = (corner(), corner());
                if round % 3 == 0 {
                    touched.unmark(TexelRect { min: a, max: a + 1 });
                    set.remove(&tile(a));
                } else {
                    let near = a.min(b) + (a.max(b) - a.min(b)) / (1 + round % 30);
                    let rect = TexelRect { min: a.min(b), max: near + 1 };
                    touched.mark(rect);
                    let tiles = |axis: usize| rect.min[axis] / DirtyTiles::TILE..=near[axis] / DirtyTiles::TILE;
                    set.extend(tiles(1).flat_map(|y| tiles(0).map(move |x| [x, y])));
                }
                touched.mark(TexelRect::default());
                let all = size.map(|side| side.div_ceil(DirtyTiles::TILE)).element_product();
                assert_eq!(touched.share(), set.len() as f32 / all as f32, "{size}");
            }
        }
    }
}
