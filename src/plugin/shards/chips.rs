//! Chips: the pieces of craters, in the air.

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
use crate::plugin::jobs::deferred::hold;
use crate::plugin::surface::active::Active;
use crate::plugin::surface::cracked::{Cracked, has_cracked};
use crate::relief::Crater;
use crate::shatter::{Burst, Cuts, Flight, Shards, ShatterError, ShatterParams, shatter};
use bevy::{
    asset::UntypedHandle,
    ecs::{entity::EntityHashMap, entity_disabling::Disabled, query::Allow},
    prelude::*,
};
use std::collections::VecDeque;

/// Hits of a surface whose chips are made in one frame; those before have none.
const MOST_HITS: usize = 4;

/// How thick chips are, as a share of the size of their crater.
const THICKNESS: f32 = 0.18;

/// How far 2D chips lie in front of their surface, in the entity's units.
const IN_FRONT: f32 = 2e-3;

/// The cosine of the most that the surface may turn from where it is hit to where a chip comes off.
const SAME_PLANE: f32 = 0.8;

/// All chips that are in the air.
#[derive(Resource, Default)]
pub(crate) struct Chips {
    /// The oldest first.
    flying: VecDeque<Flying>,
    materials: EntityHashMap<Materials>,
}

/// What the chips of a surface look like.
struct Materials {
    /// What the surface showed when they were made.
    of: UntypedHandle,
    picture: UntypedHandle,
    sides: Option<UntypedHandle>,
}

/// A chip in the air.
struct Flying {
    entity: Entity,
    surface: Entity,
    place: Place,
    flight: Flight,
    /// Seconds since the hit.
    time: f32,
}

/// Where a chip was when it was part of its surface.
#[derive(Clone, Copy)]
struct Place {
    plane: Plane,
    /// Of the surface, and the middle of the chip in it; pattern units.
    extent: Vec2,
    centroid: Vec2,
    /// Half of its thickness if it has any, in the entity's units.
    half: Option<f32>,
}

impl Flying {
    /// Where it is; `None` = nowhere any more.
    fn transform(&self) -> Option<Transform> {
        let Place { plane, extent, centroid, half } = self.place;
        let mut pose = self.flight.pose(self.time);
        if half.is_none() {
            // In 2D, z is only for the order of drawing.
            pose.offset.z = 0.0;
        }
        let place = plane.place(centroid, extent, pose, half.unwrap_or(-IN_FRONT));
        (pose.opacity > 0.0).then_some(place.with_scale(Vec3::splat(pose.opacity)))
    }
}

/// Whether there are chips, or may be.
pub(crate) fn any_chips(chips: Res<Chips>, surfaces: Query<(), With<CrackChips>>) -> bool {
    !chips.flying.is_empty() || !surfaces.is_empty()
}

/// Moves all chips, and makes those of the hits of the frame before.
pub(crate) fn fly_chips(
    world: &mut World,
    surfaces: &mut QueryState<(Entity, &CrackChips, &mut Cracked), Allow<Disabled>>,
) {
    let seconds = world.get_resource::<Time>().map_or(1.0 / 60.0, Time::delta_secs);
    let fresh = |(entity, settings, mut cracked): (Entity, &CrackChips, Mut<Cracked>)| {
        let hits = core::mem::take(&mut cracked.bypass_change_detection().get_mut()?.cracks.unchipped);
        (hits > 0).then(|| (entity, settings.clone(), hits as usize))
    };
    let fresh: Vec<_> = surfaces.iter_mut(world).filter_map(fresh).collect();
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
            let Chips { flying, materials } = &mut *chips;
            materials.retain(|surface, _| flying.iter().any(|chip| chip.surface == *surface));
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
            chip.time += seconds;
            // A surface that was healed is whole.
            let place = chip.transform().filter(|_| has_cracked(world, chip.surface));
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
        for strike in &strikes[strikes.len().saturating_sub(hits)..] {
            let layer = active.drawing.field.layer();
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
        let Some((picture, sides)) = self.materials_of(world, entity, active) else { return };
        let scale = surface.plane.size / surface.extent;
        let thickness = active.carrier.is_solid.then(|| THICKNESS * pieces.shards.extent().y * scale.y.abs());
        let plane = Plane { size: pieces.shards.extent() * scale, ..surface.plane };
        let rim = rim_for(&ShatterCracks::default(), &active.preset.look);
        let style = Style { rim, thickness, shell: None };
        let uv = [pieces.corner, pieces.corner + pieces.shards.extent()].map(|pos| surface.uv(pos));
        for &number in &pieces.numbers {
            let Some(mut shape) = pieces.shards.get(number).cloned() else { continue };
            shape.centroid += pieces.corner;
            let place = Place {
                plane: surface.plane,
                extent: surface.extent,
                centroid: shape.centroid,
                half: thickness.map(|thickness| 0.5 * thickness),
            };
            let chip = Flying { entity, surface: entity, place, flight: burst.flight(number, &shape), time: 0.0 };
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

    /// The materials of the chips of a surface: their pictures, and their sides.
    fn materials_of(
        &mut self,
        world: &mut World,
        entity: Entity,
        active: &Active,
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
        let bright = rim_for(&ShatterCracks::default(), &active.preset.look).bright;
        let sides = active
            .carrier
            .is_solid
            .then(|| kind.side_material(world, &active.carrier, active.canvas.base.mean(), bright));
        let known = Materials { of: of.clone(), picture, sides: sides.flatten() };
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
    use crate::relief::CraterParams;

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
}
