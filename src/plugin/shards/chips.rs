//! Chips: the pieces of craters, in the air, and the crumbs of shards.

use super::broken;
use super::crumbs::{self, Crumb, MOST_IN_FRAME};
use super::form::Style;
use super::release::with_active;
use super::throw::{Throw, in_plane};
use crate::math::{Rng, mix};
use crate::pattern::Strike;
use crate::plugin::api::error::EntityLabel;
use crate::plugin::api::shatter::rim_for;
use crate::plugin::api::{CrackBudget, CrackChip, CrackChips, ShatterCracks};
use crate::plugin::carrier::kind::Carrier;
use crate::plugin::carrier::plane::Plane;
use crate::plugin::carrier::shard_visual::ShardVisual;
use crate::plugin::carrier::slot::SideLook;
use crate::plugin::jobs::deferred::hold;
use crate::plugin::surface::active::Active;
use crate::plugin::surface::cracked::{Cracked, has_cracked};
use crate::relief::Crater;
use crate::shatter::{Burst, Cuts, Flight, Pose, RimLook, Shards, ShatterError, ShatterParams, shatter};
use bevy::{
    asset::UntypedHandle,
    ecs::{
        entity::{EntityHashMap, EntityHashSet},
        entity_disabling::Disabled,
        query::Allow,
    },
    prelude::*,
};
use std::collections::VecDeque;

/// Hits of a surface whose chips are made in one frame; those before have none.
const MOST_HITS: usize = 4;

/// How thick chips are, as a share of the size of their crater.
const THICKNESS: f32 = 0.18;

/// How much of the picture a crumb shows in 2D, pattern units.
const PATCH: f32 = 0.004;

/// How far 2D chips lie in front of their surface, in the entity's units.
const IN_FRONT: f32 = 2e-3;

/// The cosine of the most that the surface may turn from where it is hit to where a chip comes off.
const SAME_PLANE: f32 = 0.8;

/// How long a crumb takes to be seen when it comes off, seconds.
const GROWING: f32 = 0.05;

/// All chips and crumbs that are in the air.
#[derive(Resource, Default)]
pub(crate) struct Chips {
    /// The oldest first.
    flying: VecDeque<Flying>,
    materials: EntityHashMap<Materials>,
    crumbs: EntityHashMap<CrumbLook>,
}

/// What the chips of a surface look like.
struct Materials {
    /// What the surface showed when they were made.
    of: UntypedHandle,
    picture: UntypedHandle,
    sides: Option<UntypedHandle>,
}

/// What the crumbs of a surface look like.
struct CrumbLook {
    meshes: Vec<Handle<Mesh>>,
    material: UntypedHandle,
}

/// A chip or a crumb in the air.
struct Flying {
    entity: Entity,
    surface: Entity,
    home: Home,
    flight: Flight,
    /// When the shard of a crumb began its flight, seconds since the surface broke; `None` = it is a chip.
    start: Option<f64>,
    /// Seconds since the hit.
    time: f32,
}

/// Where a chip or a crumb was when it was part of its surface.
#[derive(Clone, Copy)]
struct Home {
    /// There it lies as it is turned in its flight; and how large it is.
    place: Transform,
    /// How it lies besides.
    turn: Quat,
    /// Units of the entity for a pattern unit.
    unit: Vec3,
    is_flat: bool,
}

impl Flying {
    /// Where it is; `None` = nowhere any more.
    fn transform(&self) -> Option<Transform> {
        let Home { place, turn, unit, is_flat } = self.home;
        let mut pose = self.flight.pose(self.time);
        if is_flat {
            // In 2D, z is only for the order of drawing.
            pose.offset.z = 0.0;
        }
        let since = if self.start.is_some() { (self.time - self.flight.delay) / GROWING } else { 1.0 };
        Some(Transform {
            translation: place.translation + place.rotation * (pose.offset * unit),
            rotation: place.rotation * pose.rotation * turn,
            scale: place.scale * (pose.opacity * since.clamp(0.01, 1.0)),
        })
        .filter(|_| pose.opacity > 0.0)
    }

    /// Lets time pass: of a crumb, that of the shards. Returns whether it is still there.
    fn pass(&mut self, world: &World, seconds: f32) -> bool {
        let Some(start) = self.start else {
            self.time += seconds;
            return true;
        };
        let Some(now) = broken::time_of(world, self.surface) else { return false };
        let before = core::mem::replace(&mut self.time, (now - start) as f32);
        // Back at its edge it is part of the shard again.
        self.time >= before || self.time > self.flight.delay
    }
}

/// Whether there are chips or crumbs, or may be.
pub(crate) fn any_chips(chips: Res<Chips>, surfaces: Query<(), With<CrackChips>>) -> bool {
    !chips.flying.is_empty() || !surfaces.is_empty()
}

/// Moves all chips and crumbs, and makes those of the hits of the frame before, and of the shards of this one.
pub(crate) fn fly_chips(
    world: &mut World,
    surfaces: &mut QueryState<(Entity, &CrackChips, &mut Cracked), Allow<Disabled>>,
) {
    let seconds = world.get_resource::<Time>().map_or(1.0 / 60.0, Time::delta_secs);
    let fresh = |(entity, settings, mut cracked): (Entity, &CrackChips, Mut<Cracked>)| {
        let hits = core::mem::take(&mut cracked.bypass_change_detection().get_mut()?.cracks.unchipped);
        (hits > 0).then(|| (entity, settings.clone(), hits as usize))
    };
    let mut shed = Vec::new();
    let fresh: Vec<_> = surfaces.iter_mut(world).inspect(|(entity, ..)| shed.push(*entity)).filter_map(fresh).collect();
    hold(world, |world| {
        world.resource_scope(|world, mut chips: Mut<Chips>| {
            chips.fly(world, seconds);
            for (entity, settings, hits) in fresh {
                let made = with_active(world, entity, |world, active| {
                    chips.make(world, entity, active, &settings, hits.min(MOST_HITS))
                });
                if let Some(Err(error)) = made {
                    warn_once!("{} has no chips: {error}", EntityLabel::of(world, entity));
                }
            }
            let mut room = MOST_IN_FRAME;
            for entity in shed {
                let Some((crumbs, inside, rim)) = broken::take_crumbs(world, entity) else { continue };
                let crumbs = crumbs.into_iter().take(room).collect::<Vec<Crumb>>();
                room -= crumbs.len();
                with_active(world, entity, |world, active| chips.scatter(world, entity, active, crumbs, (inside, rim)));
            }
            let Chips { flying, materials, crumbs } = &mut *chips;
            let known: EntityHashSet = flying.iter().map(|chip| chip.surface).collect();
            materials.retain(|surface, _| known.contains(surface));
            crumbs.retain(|surface, _| known.contains(surface));
        });
    });
}

impl Chips {
    fn fly(&mut self, world: &mut World, seconds: f32) {
        let most = world.resource::<CrackBudget>().max_shards;
        let excess = self.flying.len().saturating_sub(most);
        for chip in self.flying.drain(..excess) {
            world.try_despawn(chip.entity).ok();
        }
        self.flying.retain_mut(|chip| {
            // A surface that was healed is whole.
            let is_there = chip.pass(world, seconds) && has_cracked(world, chip.surface);
            let place = chip.transform().filter(|_| is_there);
            match (place, world.get_mut::<Transform>(chip.entity)) {
                (Some(place), Some(mut transform)) => {
                    transform.set_if_neq(place);
                    true
                }
                _ => {
                    world.try_despawn(chip.entity).ok();
                    false
                }
            }
        });
    }

    /// Makes the chips of the last hits of a surface.
    fn make(
        &mut self,
        world: &mut World,
        entity: Entity,
        active: &Active,
        settings: &CrackChips,
        hits: usize,
    ) -> Result<(), ShatterError> {
        let strikes = active.cracks.growth.timeline().strikes();
        // Not from what is drawn, which may be with a task.
        let layer = active.preset.look.layer(active.surface.seed);
        for strike in &strikes[strikes.len().saturating_sub(hits)..] {
            let crater = layer.crater(strike.impact, strike.pos, strike.energy);
            let Some(crater) = crater else { continue };
            let before = layer.crater(strike.impact, strike.pos, strike.before);
            let Some(surface) = Surface::of(world, entity, active, strike.pos) else { continue };
            let burst = surface.burst(world, entity, active, settings, strike)?;
            let count = settings.count.min(CrackChips::MOST) as f32 * strike.energy.max(0.0).sqrt();
            let seed = mix(active.surface.seed ^ u64::from(strike.impact) << 32 ^ u64::from(strike.energy.to_bits()));
            let count = (count.round() as usize).min(CrackChips::MOST as usize);
            let is_there = |pos: Vec2| surface.lies_in_its_plane(world, entity, active, pos);
            let Some(cut) = Pieces::of(&crater, before.as_ref(), (count, surface.extent), is_there, seed) else {
                continue;
            };
            self.release(world, entity, active, &surface, (&cut, &burst), seed);
        }
        Ok(())
    }

    fn release(
        &mut self,
        world: &mut World,
        entity: Entity,
        active: &Active,
        surface: &Surface,
        (pieces, burst): (&Pieces, &Burst),
        seed: u64,
    ) {
        let scale = surface.plane.size / surface.extent;
        let Some((picture, sides)) = self.materials_of(world, entity, active, scale.y.abs()) else { return };
        let thickness = active.carrier.is_solid.then(|| THICKNESS * pieces.shards.extent().y * scale.y.abs());
        let plane = Plane { size: pieces.shards.extent() * scale, ..surface.plane };
        let rim = rim_for(&ShatterCracks::default(), &active.preset.look);
        let style = Style { rim, thickness, shell: None };
        let uv = [pieces.corner, pieces.corner + pieces.shards.extent()].map(|pos| surface.uv(pos));
        for &number in &pieces.numbers {
            let Some(mut shape) = pieces.shards.get(number).cloned() else { continue };
            shape.centroid += pieces.corner;
            let forward = thickness.map_or(-IN_FRONT, |thickness| 0.5 * thickness);
            let home = Home {
                place: surface.plane.place(shape.centroid, surface.extent, Pose::AT_REST, forward),
                turn: Quat::IDENTITY,
                unit: scale.extend(scale.y.abs()),
                is_flat: thickness.is_none(),
            };
            let flight = burst.flight(number, &shape);
            let chip = Flying { entity, surface: entity, home, flight, start: None, time: 0.0 };
            let Some(place) = chip.transform() else { continue };
            let form = style.form(&pieces.shards, number, &plane, uv, seed ^ u64::from(number));
            let Some(mut meshes) = world.get_resource_mut::<Assets<Mesh>>() else { return };
            let (mesh, side) = (meshes.add(form.picture), form.sides.map(|sides| meshes.add(sides)));
            let visual = ShardVisual { parent: entity, place, mesh, material: picture.clone() };
            let visuals = active.carrier.kind.shards();
            let Some(Some(made)) = visuals.spawn_sides(world, vec![visual]).pop() else { continue };
            if let Some((mesh, material)) = side.zip(sides.clone()) {
                let side = ShardVisual { parent: made, place: Transform::default(), mesh, material };
                visuals.spawn_sides(world, vec![side]);
            }
            if let Ok(mut made) = world.get_entity_mut(made) {
                made.insert(CrackChip { surface: entity });
            }
            self.flying.push_back(Flying { entity: made, ..chip });
        }
    }

    /// Makes entities of crumbs. `inside` is what the sides of their shards are made of.
    fn scatter(
        &mut self,
        world: &mut World,
        entity: Entity,
        active: &Active,
        crumbs: Vec<Crumb>,
        (inside, rim): (Option<UntypedHandle>, RimLook),
    ) {
        let Some(now) = broken::time_of(world, entity) else { return };
        let Some((meshes, material)) = self.crumb_look(world, entity, active, &crumbs, (inside, rim)) else { return };
        let is_flat = !active.carrier.is_solid;
        let (mut made, mut visuals) = (Vec::new(), Vec::new());
        for Crumb { mut home, turn, unit, flight, start, shape, .. } in crumbs {
            if is_flat {
                home.translation += home.rotation * Vec3::Z * IN_FRONT;
            }
            let home = Home { place: home, turn, unit, is_flat };
            let time = (now - start) as f32;
            let crumb = Flying { entity, surface: entity, home, flight, start: Some(start), time };
            let (Some(place), Some(mesh)) = (crumb.transform(), meshes.get(shape)) else { continue };
            visuals.push(ShardVisual { parent: entity, place, mesh: mesh.clone(), material: material.clone() });
            made.push(crumb);
        }
        let entities = active.carrier.kind.shards().spawn_sides(world, visuals);
        for (crumb, entity) in made.into_iter().zip(entities) {
            let Some(entity) = entity else { continue };
            if let Ok(mut made) = world.get_entity_mut(entity) {
                made.insert(CrackChip { surface: crumb.surface });
            }
            self.flying.push_back(Flying { entity, ..crumb });
        }
    }

    /// The meshes of the crumbs of a surface, and their material: that of the sides of shards, in 2D their picture.
    fn crumb_look(
        &mut self,
        world: &mut World,
        entity: Entity,
        active: &Active,
        crumbs: &[Crumb],
        (inside, rim): (Option<UntypedHandle>, RimLook),
    ) -> Option<(Vec<Handle<Mesh>>, UntypedHandle)> {
        if let Some(known) = self.crumbs.get(&entity) {
            return Some((known.meshes.clone(), known.material.clone()));
        }
        let seed = active.surface.seed;
        let (shapes, material) = match inside {
            Some(inside) => (crumbs::solid_shapes(seed), inside),
            None => {
                let surface = Surface::of(world, entity, active, crumbs.first()?.at)?;
                let places: Vec<Vec2> = crumbs.iter().map(|crumb| surface.uv(crumb.at)).collect();
                let reach = (surface.uv(Vec2::splat(PATCH)) - surface.uv(Vec2::ZERO)).abs();
                let (picture, _) = self.materials_of(world, entity, active, 1.0)?;
                (crumbs::flat_shapes(seed, rim, &places, reach), picture)
            }
        };
        let mut meshes = world.get_resource_mut::<Assets<Mesh>>()?;
        let meshes: Vec<Handle<Mesh>> = shapes.into_iter().map(|mesh| meshes.add(mesh)).collect();
        self.crumbs.insert(entity, CrumbLook { meshes: meshes.clone(), material: material.clone() });
        Some((meshes, material))
    }

    /// The materials of the chips of a surface: their pictures, and their sides. A pattern unit is `unit` long.
    fn materials_of(
        &mut self,
        world: &mut World,
        entity: Entity,
        active: &Active,
        unit: f32,
    ) -> Option<(UntypedHandle, Option<UntypedHandle>)> {
        let Carrier { kind, own, shown, is_twofold, unfolding, .. } = &active.carrier;
        let of = own.as_ref().unwrap_or(&shown.asset);
        if let Some(known) = self.materials.get(&entity).filter(|known| known.of == *of) {
            return Some((known.picture.clone(), known.sides.clone()));
        }
        // The picture without cracks, unless the surface has it laid out in another way.
        let is_its_own = unfolding.as_ref().is_none_or(|unfolding| unfolding.is_own);
        let plain = shown.diffuse.as_ref().filter(|_| shown.layout.is_none() && !is_twofold && is_its_own);
        let image = plain.or(active.canvas.textures.diffuse.as_ref())?.clone();
        let picture = kind.shard_material(world, entity, &active.carrier, &image, 1.0)?;
        let rim = rim_for(&ShatterCracks::default(), &active.preset.look);
        let look = SideLook { mean: active.canvas.base.mean(), rim, unit };
        let sides = if active.carrier.is_solid { kind.side_material(world, &active.carrier, &look) } else { None };
        let known = Materials { of: of.clone(), picture, sides };
        let materials = (known.picture.clone(), known.sides.clone());
        self.materials.insert(entity, known);
        Some(materials)
    }
}

/// What is to be known of a surface that chips come off.
struct Surface {
    plane: Plane,
    /// Pattern units.
    extent: Vec2,
    /// The part of the texture that it shows.
    uv: [Vec2; 2],
}

impl Surface {
    /// As it is where it is hit, at `pos`, pattern units. `None` if it shows nothing, or is neither flat nor laid out.
    fn of(world: &World, entity: Entity, active: &Active, pos: Vec2) -> Option<Self> {
        let seen = active.canvas.seen()?;
        let kind = active.carrier.kind;
        let plane = match &active.carrier.unfolding {
            Some(unfolding) => kind.plane_at(world, entity, pos * unfolding.unit)?,
            None => kind.plane(world, entity, seen).ok()?,
        };
        let size = active.canvas.base.size.as_vec2();
        let uv = [seen.min.as_vec2() / size, seen.max.as_vec2() / size];
        Some(Self { plane, extent: active.cracks.growth.network().extent(), uv })
    }

    /// Whether a place, pattern units, lies about in the plane; always on what is flat.
    fn lies_in_its_plane(&self, world: &World, entity: Entity, active: &Active, pos: Vec2) -> bool {
        active.carrier.unfolding.as_ref().is_none_or(|unfolding| {
            let there = active.carrier.kind.plane_at(world, entity, pos * unfolding.unit);
            there.is_some_and(|there| (there.rotation * Vec3::Z).dot(self.plane.rotation * Vec3::Z) > SAME_PLANE)
        })
    }

    /// Texture coordinates of a place, pattern units.
    fn uv(&self, pos: Vec2) -> Vec2 {
        let [min, max] = self.uv;
        min + pos / self.extent * (max - min)
    }

    fn burst(
        &self,
        world: &World,
        entity: Entity,
        active: &Active,
        settings: &CrackChips,
        strike: &Strike,
    ) -> Result<Burst, ShatterError> {
        let direction = active.cracks.last_hit.map_or(Vec3::ZERO, |hit| hit.direction);
        let direction = in_plane(world, entity, &self.plane, direction);
        // What goes into the surface throws them back.
        let direction = if direction == Vec3::ZERO { Vec3::Z } else { direction.with_z(direction.z.abs()) };
        let throw = Throw {
            params: settings.burst,
            gravity: settings.gravity,
            floor: settings.floor,
            thickness: active.carrier.is_solid.then_some(0.0),
            depth: 0.0,
            seed: active.surface.seed ^ u64::from(strike.impact),
        };
        let hit = (strike.pos, direction, strike.energy.clamp(0.0, 1000.0));
        throw.burst(world.get(entity), (&self.plane, self.extent), hit)
    }
}

/// A crater in pieces.
struct Pieces {
    /// Of the square around the crater.
    shards: std::sync::Arc<Shards>,
    /// The top left of that square, pattern units.
    corner: Vec2,
    /// Those that come off.
    numbers: Vec<u32>,
}

impl Pieces {
    /// About `count` pieces of a crater, of what is not in the crater `before`, lies on the surface, and `is_there`.
    fn of(
        crater: &Crater,
        before: Option<&Crater>,
        (count, extent): (usize, Vec2),
        is_there: impl Fn(Vec2) -> bool,
        seed: u64,
    ) -> Option<Self> {
        let rings = crater.contours().rings;
        let outer = rings.first()?;
        let reach = 1.01 * crater.reach();
        let centre = crater.center();
        let corner = centre - reach;
        let mut cuts = Cuts::new(Vec2::splat(2.0 * reach)).ok()?;
        for ring in &rings {
            let line = ring.points.iter().chain(ring.points.first());
            cuts.add_line(&line.map(|point| *point - corner).collect::<Vec<Vec2>>()).ok()?;
        }
        // Each ray cuts all rings; between two of them another one cuts only the outermost.
        let rays = (count / (rings.len() + 1)).max(3);
        let mut rng = Rng::new(seed).stream("chips");
        for ray in 0..rays {
            for is_whole in [true, false] {
                let place = (ray as f32 + if is_whole { 0.0 } else { 0.5 } + 0.3 * rng.unit()) / rays as f32;
                let at = (place * outer.points.len() as f32) as usize % outer.points.len();
                let inner = if is_whole || rings.len() == 1 { &rings[..] } else { &rings[..2] };
                let ends = inner.iter().rev().map(|ring| ring.points[at]);
                let from = (is_whole || rings.len() == 1).then_some(centre);
                let line: Vec<Vec2> = from.into_iter().chain(ends).map(|point| point - corner).collect();
                cuts.add_line(&line).ok()?;
            }
        }
        let params = ShatterParams { max_shards: 1024, ..ShatterParams::DEFAULT };
        let shards = shatter(cuts, &params).ok()?;
        let is_on = |number: &u32| {
            let outline =
                shards.outline(*number).iter().map(|corner_of| shards.positions()[*corner_of as usize] + corner);
            let mut outline = outline.map(|pos| pos.cmpge(Vec2::ZERO).all() && pos.cmple(extent).all());
            outline.all(|is_on| is_on)
        };
        let comes_off = |number: &u32| {
            let place = shards.inner_point(*number).map(|place| place + corner);
            place.is_some_and(|place| {
                let is_new = before.is_none_or(|before| before.depth_at(place) == 0.0);
                crater.depth_at(place) > 0.0 && is_new && is_there(place)
            })
        };
        let mut numbers: Vec<u32> =
            (0..shards.len() as u32).filter(|number| comes_off(number) && is_on(number)).collect();
        // The largest are seen best.
        let area = |number: &u32| shards.get(*number).map_or(0.0, |shard| shard.area);
        numbers.sort_by(|a, b| area(b).total_cmp(&area(a)).then(a.cmp(b)));
        numbers.truncate(count);
        Some(Self { shards: shards.into(), corner, numbers })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    #[cfg(feature = "2d")]
    use crate::plugin::{
        draw::async_playback::is_at_work,
        headless::{app, blank},
        jobs::threads::Threads,
        prelude::*,
    };
    use crate::relief::CraterParams;
    #[cfg(feature = "2d")]
    use bevy::time::TimeUpdateStrategy;
    #[cfg(feature = "2d")]
    use std::time::Duration;

    /// Pieces tile what is new of a crater, and lie on the surface.
    #[test]
    fn pieces_are_what_comes_off() {
        let mut rng = Rng::new(11);
        for seed in 0..60 {
            let params = CraterParams {
                radius: rng.range(0.01, 0.3),
                terraces: 1 + seed % 4,
                roughness: rng.unit(),
                ..CraterParams::DEFAULT
            };
            let (centre, extent) = (Vec2::new(rng.unit(), rng.unit()), Vec2::ONE);
            let crater = Crater::new(centre, &params, u64::from(seed)).unwrap();
            let small = CraterParams { radius: 0.5 * params.radius, ..params };
            let before = (seed % 2 == 0).then(|| Crater::new(centre, &small, u64::from(seed)).unwrap());
            let pieces = Pieces::of(&crater, before.as_ref(), (64, extent), |_| true, u64::from(seed)).unwrap();
            let mut covered = 0.0;
            for number in &pieces.numbers {
                let place = pieces.shards.inner_point(*number).unwrap() + pieces.corner;
                assert!(crater.depth_at(place) > 0.0 && before.as_ref().is_none_or(|it| it.depth_at(place) == 0.0));
                covered += pieces.shards.get(*number).unwrap().area;
            }
            let is_inside =
                centre.min_element() > 2.0 * params.radius && centre.max_element() < 1.0 - 2.0 * params.radius;
            if before.is_none() && is_inside {
                let area = crater.contours().rings[0].signed_area().abs() as f32;
                assert!((covered - area).abs() < 0.01 * area, "seed {seed}: {covered} of {area}");
            }
            assert!(pieces.numbers.len() <= 64);
        }
    }

    #[test]
    fn few_chips_are_the_largest_and_none_are_none() {
        let crater = Crater::new(Vec2::splat(0.5), &CraterParams::DEFAULT, 3).unwrap();
        let of = |count| Pieces::of(&crater, None, (count, Vec2::ONE), |_| true, 1).unwrap();
        assert_eq!(of(0).numbers.len(), 0);
        let some = of(5);
        let areas: Vec<f32> = some.numbers.iter().map(|number| some.shards.get(*number).unwrap().area).collect();
        assert!(areas.len() == 5 && areas.is_sorted_by(|a, b| a >= b));
        assert!((30..=64).contains(&of(64).numbers.len()), "{}", of(64).numbers.len());
    }

    /// A hit on a surface that is being drawn again has its chips.
    #[cfg(feature = "2d")]
    #[test]
    fn surfaces_that_are_drawn_again_have_chips() {
        // One slice in a frame.
        let mut app = app(CrackBudget { milliseconds: 0.0, ..default() });
        app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_millis(16)));
        app.world_mut().resource_mut::<Threads>().are_missing = true;
        let image = app.world_mut().resource_mut::<Assets<Image>>().add(blank(UVec2::new(600, 500)));
        let surface = CrackSurface::new(CrackPreset::CONCRETE).with_seed(4);
        let entity = app.world_mut().spawn((Sprite::from_image(image), surface, CrackChips::default())).id();
        let hit =
            |app: &mut App, x: f32| app.world_mut().trigger(CrackHit::uv(entity, Vec2::new(x, 0.5)).with_energy(2.0));
        hit(&mut app, 0.3);
        let mut chips = app.world_mut().query_filtered::<(), With<CrackChip>>();
        for _ in 0..3000 {
            app.update();
        }
        assert_eq!(chips.iter(app.world()).count(), 0, "the first ones have come to rest and gone");
        let mut surface = app.world_mut().get_mut::<CrackSurface>(entity).expect("it cracks");
        surface.preset = CrackPreset { profile: CrackPreset::CLAY.profile, ..CrackPreset::CONCRETE }.into();
        app.update();
        hit(&mut app, 0.7);
        for _ in 0..4 {
            app.update();
        }
        assert!(is_at_work(app.world(), entity), "it is being drawn");
        assert!(chips.iter(app.world()).count() > 5, "{} chips", chips.iter(app.world()).count());
    }
}
