//! The settings of a growth: [`GrowthParams`].

mod text;
mod vary;

use crate::{math::ops, strands::StrandParams};
use glam::Vec2;

/// How markers are laid out around a hit.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "bevy", derive(bevy::reflect::Reflect))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub enum MarkerLayout {
    /// The vertices of a grid of `num_lines_grid` x `num_columns_grid`, each with a given probability (Couto et al.,
    /// 4.1).
    PseudoGrid {
        /// Probability that a vertex has a marker, 0..=1.
        occupancy: f32,
        /// Largest distance of a marker from its vertex, as a share of the cell, 0..=1.
        jitter: f32,
    },
    /// Random points no closer than `spacing` to each other (dart throwing: Cook 1986, as used by Runions et al.
    /// 2005).
    DartThrowing {
        /// Smallest distance between markers, pattern units, 0.002..=1.
        spacing: f32,
    },
    /// Straight rays around the hit (glass, ice). Each ray has its own markers, which attract only the nodes of that
    /// ray. The rays start on the rim of the crushed zone ([`StartLayout::Crushed`]). With `draw_connections` they
    /// are joined by rings: broken polygons whose distance increases outward, up to the reach. Near the border there
    /// are fewer rays.
    Rays {
        /// Number of rays of a hit of energy 1, 1..=360. It is proportional to the energy to the power of 0.45.
        sectors: u32,
        /// Irregularity of the angles and rings, and how much the rays kink, 0..=1.
        jitter: f32,
        /// Share of the rays that run until they meet the border or another crack, 0..=1. The others end within the
        /// reach, most of them near the hit. They end at a ring if there are rings; the share
        /// [`open_ends`](GrowthParams::open_ends) of them ends freely.
        through: f32,
    },
    /// No markers: [strands](crate::strands) run out from the hit, with branches, along a field of directions that lead away
    /// from it and are turned by noise (asphalt, marble, sand). They stop at older cracks if there is
    /// [`arrest`](GrowthParams::arrest). A hit that is added to an earlier one adds the strands of its energy.
    Strands {
        /// Number of strands of a hit of energy 1, 1..=1024. It is proportional to the cube root of the energy; there are
        /// fewer near the border.
        count: u32,
        /// Noise, inertia, branches and primitives. [`length`](StrandParams::length) is that of a strand at energy 1; it is
        /// proportional to the root of the energy. Widths are those of the growth: `width`, `child_width` and `taper` are
        /// not used.
        strands: StrandParams,
    },
}

/// How cracks compete for markers, and whether they close loops.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "bevy", derive(bevy::reflect::Reflect))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Venation {
    /// A marker attracts its nearest node and is removed when a node reaches it. Cracks branch and do not join.
    #[default]
    Open,
    /// A marker attracts all its relative neighbours and is removed when each of them has reached it (Runions et al.
    /// 2005). Cracks join and close cells.
    Closed,
    /// Cracks do not branch; each divides a domain in two. A crack begins where a marker is farthest from all older
    /// cracks, across the shorter direction of the domain around it. It grows both ways, attracted by the markers
    /// ahead of its tips, until it meets older cracks. This goes on until all markers are within the kill distance of
    /// a crack. No two cracks cross, as with [`arrest`](GrowthParams::arrest).
    /// [`nucleation`](GrowthParams::nucleation) sets how many cracks begin in each step,
    /// [`focus`](GrowthParams::focus) how much finer the domains are near the hit. With
    /// [`open_ends`](GrowthParams::open_ends) at 0 even the ends that leave the reach of the hit grow on until they
    /// meet something. Markers should lie closer than 0.7 kill distances.
    Subdivision,
}

/// The nodes from which the cracks of a hit start.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "bevy", derive(bevy::reflect::Reflect))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub enum StartLayout {
    /// One node at the hit.
    Point,
    /// One node at the hit and others scattered over its reach. Their number is proportional to the energy.
    Points {
        /// Number of nodes at energy 1, 1..=1024.
        count: u32,
    },
    /// One node at the hit, and one segment from it for each of `count` arms. The number is proportional to the cube
    /// root of the energy. Arms are spread over the directions that have room: there are fewer where the border is
    /// near.
    Arms {
        /// Number of arms at energy 1, 1..=1024.
        count: u32,
    },
    /// `count` nodes, evenly spaced on a circle around the hit.
    Ring {
        /// Number of nodes, 1..=1024.
        count: u32,
        /// Radius of the circle, pattern units, 0..=1.
        radius: f32,
    },
    /// Nodes on the rim of a crushed zone, joined to each other by segments. The inside of the zone is drawn by the
    /// look. With [`MarkerLayout::Rays`] there is one node for each ray that starts there; else there are `count`
    /// nodes, in proportion to the root of the energy.
    Crushed {
        /// Number of nodes on the rim at energy 1, 1..=1024.
        count: u32,
        /// Radius at energy 1, pattern units, 0..=1. It is proportional to the fourth root of the energy.
        radius: f32,
    },
    /// `count` nodes scattered over a disc around the hit.
    Disc {
        /// Number of nodes, 1..=1024.
        count: u32,
        /// Radius of the disc, pattern units, 0..=1.
        radius: f32,
    },
}

/// All settings of a growth except its seed and its hits.
///
/// ```
/// use bevy_crack::growth::{GrowthParams, StartLayout};
///
/// let params = GrowthParams { reach: 0.4, starts: StartLayout::Arms { count: 6 }, ..GrowthParams::DEFAULT };
/// assert_eq!(params.validate(), Ok(()));
/// ```
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "bevy", derive(bevy::reflect::Reflect))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields, default))]
pub struct GrowthParams {
    /// Distance at which a marker counts as reached and is removed. Pattern units, 0.0005..=4, at most
    /// [`crack_radius`](Self::crack_radius); default 0.03.
    pub kill_distance: f32,
    /// Length of a segment: the distance `D` from a node to the node that grows from it. Pattern units, 0.001..=4; default 0.02.
    pub step_length: f32,
    /// Largest distance at which a marker attracts a node. Pattern units, 0.001..=32, at most 256 times
    /// [`step_length`](Self::step_length); default 0.2.
    pub crack_radius: f32,
    /// Largest number of growth steps after each hit, 1..=100000; default 200.
    pub num_iterations: u32,
    /// Rows of the marker grid on a square surface, 1..=512; default 20. A taller surface has proportionally more, up to 4096.
    pub num_lines_grid: u32,
    /// Columns of the marker grid on a square surface, 1..=512; default 20. A wider surface has proportionally more, up to 4096.
    pub num_columns_grid: u32,
    /// How markers are laid out. Default: a [`PseudoGrid`](MarkerLayout::PseudoGrid) of occupancy 0.7 and jitter 0.8.
    pub markers: MarkerLayout,
    /// How cracks compete for markers, and whether they close loops. Default: [`Open`](Venation::Open).
    pub venation: Venation,
    /// How much denser markers and forks are near the hit: 0 = the same everywhere, 4 = nearly all in the inner half.
    /// 0..=4; default 0.
    pub focus: f32,
    /// Radius around a hit of energy 1 that is filled with markers. It is proportional to the root of the energy.
    /// Pattern units, 0.01..=64; default 0.6.
    pub reach: f32,
    /// How much the reach varies with direction: it is shorter by up to this share of it, for all layouts but rays, and
    /// by less near the border.
    /// With [`Venation::Subdivision`] the reach is uneven even at 0. 0..=0.9; default 0.
    pub reach_variation: f32,
    /// The nodes from which the cracks of a hit start. Default: [`Point`](StartLayout::Point).
    pub starts: StartLayout,
    /// Width of a crack at its tip. Pattern units, 0.0005..=0.2; default 0.004.
    pub line_width: f32,
    /// How fast cracks widen with the number of nodes that have grown from them; 0 = not at all. A node with `n`
    /// nodes behind it, itself included, is `1 + line_growth (n^(1/murray) - 1)` times as wide as
    /// [`line_width`](Self::line_width). Nodes of other hits do not count, and beyond a crack of another hit a crack
    /// is half as wide. 0..=16; default 0.4.
    pub line_growth: f32,
    /// Exponent of the pipe model: at a `line_growth` of 1 a node with `n` nodes behind it is `n^(1/murray)` times as
    /// wide as a tip. 1..=8; default 3.
    pub murray: f32,
    /// Largest width that [`line_growth`](Self::line_growth) gives a crack at energy 1; at least `line_width`. Pattern
    /// units, 0.0005..=0.4; default 0.03. All widths are proportional to the fourth root of the energy: 16 makes them twice as wide.
    pub max_width: f32,
    /// Number of segments over which a free end narrows to a point. An end that meets another crack does not narrow.
    /// 0 = ends are as wide as `line_width`. 0..=64; default 4.
    pub tip_taper: f32,
    /// How much the width varies along a crack: it is reduced by up to this share. 0..=0.9; default 0.
    pub unevenness: f32,
    /// How strongly a crack keeps its direction against the pull of the markers: 0 = not at all, 1 = as strongly as
    /// it follows them. In areas that a [mask](crate::pattern::CrackMask) marks as weak the value is lower, down to
    /// 0: there the crack follows the joint. 0..=8; default 0.
    pub inertia: f32,
    /// Preferred direction of cracks, radians from the x axis (y points down): perpendicular to the tension in the
    /// surface. -7..=7; default 0.
    pub axis: f32,
    /// How strongly cracks follow [`axis`](Self::axis): 0 = not at all, 1 = nearly straight along it. 0..=1; default 0.
    pub directed: f32,
    /// Random deviation of the direction of growth, radians, 0..=1; default 0.1.
    pub wander: f32,
    /// Size of the grains that cracks go around: within a grain a crack runs straight, and at the border of a grain
    /// it kinks by up to twice [`wander`](Self::wander). Pattern units, 0..=1; 0 = no grains, cracks deviate at every
    /// node; default 0.
    pub grain: f32,
    /// How regularly cracks deviate left and right in turn instead of at random (drawn cracks): 0 = not at all, 1 =
    /// at every node. The overall direction of the crack stays the same. 0..=1; default 0.
    pub zigzag: f32,
    /// Share of nodes at which a tip forks, 0..=1; default 0. A side branch starts ahead if there are markers in its direction.
    /// [`focus`](Self::focus) makes forks rarer away from the hit, as it does markers. Only with
    /// [`arrest`](Self::arrest). With [rays](MarkerLayout::Rays) the share is proportional to the energy to the power
    /// of 0.6, forks fork again half as often, and the angle is at least 0.42.
    pub forks: f32,
    /// Angle between the two branches of a fork, radians, 0.2..=1.6; default 0.7. Each fork deviates from it by up to a quarter.
    pub fork_angle: f32,
    /// Roughness of the line between two nodes, as a share of its length, 0..=0.5; default 0.12.
    pub roughness: f32,
    /// Whether nodes whose parents have the same generation are joined (the rings of glass); default false.
    pub draw_connections: bool,
    /// Share of the possible connections that are left out, 0..=1; default 0.3.
    pub connection_gaps: f32,
    /// Number of generations to the first ring of connections. The following rings are 2, 3, 4 ... times as far
    /// apart. 1..=1000; default 1.
    pub connection_every: u32,
    /// Whether nodes of different branches are joined where they are close (the cells of clay); default false.
    pub draw_islands: bool,
    /// Largest distance at which [`draw_islands`](Self::draw_islands) joins two nodes. Pattern units, 0..=1; default 0.03.
    pub island_distance: f32,
    /// Distance at which a tip reacts to an older crack or the border ahead of it, pattern units, 0..=1; default 0. The tip
    /// turns to meet it at a steep angle and stops there. The distance used is at least 2.5 segment lengths, which
    /// the turn needs. No two cracks cross then. Cracks that branch break through those of older hits within 0.6 of the
    /// reach of their hit: they go on beside the place where they met them. 0 = off: cracks ignore each other, as in
    /// the papers.
    pub arrest: f32,
    /// Share of tips that stop before they reach the crack that they would have met, 0..=1; default 0.
    pub open_ends: f32,
    /// Number of new cracks for each step of growth that start where markers are out of reach of all cracks, 0..=64; default 0.
    /// They start late, so they end at the older cracks.
    pub nucleation: f32,
    /// With [`Venation::Subdivision`]: number of generations of cracks. The domains of each generation are 1.6 times
    /// smaller, and its cracks half as wide, as those of the generation before. 1..=4; default 1.
    pub generations: u32,
    /// With [`Venation::Subdivision`]: share of the cracks that start with three arms, 120 degrees apart, instead of
    /// two. This happens where a domain is about as wide as long; more cells have five and six sides then. 0..=1; default 0.
    pub three_arm_share: f32,
    /// With [`Venation::Subdivision`]: how strongly a crack keeps the direction in which it started, with kinks instead
    /// of bends, straight across the widest place of its domain. Plates become polygons, and no two cracks meet a
    /// third one at the same place from both sides. 0..=1; default 0.
    pub straightness: f32,
    /// With [`Venation::Subdivision`]: how much thinner cracks and how much larger domains become towards the rim of the
    /// area that the hit has loaded. At 1 next to nothing is left at the rim. 0..=1; default 0.
    pub thinning: f32,
    /// With [`Venation::Subdivision`]: how much the width varies between cracks of one generation: a crack is narrower
    /// than the widest ones by up to this share. 0..=0.9; default 0.
    pub width_variation: f32,
    /// With [`Venation::Subdivision`]: speed of the front that runs outward from the hit; cracks start behind it.
    /// Pattern units for each step since the hit; 0 = cracks start anywhere at once. 0..=1; default 0.
    pub front: f32,
    /// With [`Venation::Subdivision`]: how much larger domains are in random patches of a few domains each: the size is
    /// multiplied by up to 1 plus this value. 0..=4; default 0.
    pub patchiness: f32,
    /// How much surfaces differ from each other by their seed: widths, roughness, the spacing of markers, the number
    /// of starts and of free ends, the axis. 0 = not at all; at 1 each value differs by a factor of up to 2 either
    /// way, mostly much less. 0..=1; default 0.
    pub variety: f32,
    /// Height of the courses of bricks. Cracks run in the joints between them. It is used where the
    /// [mask](crate::pattern::CrackMask) shows no lines; where the mask shows courses, those are used. No crack is
    /// wider than a joint then. Pattern units, 0..=1; 0 = the surface is not masonry; default 0.
    pub courses: f32,
    /// How far lines are displaced by smooth noise, together with everything that follows them: uneven joints.
    /// Pattern units, 0..=0.05; 0 = not at all; default 0.
    pub distortion: f32,
    /// Whether the markers themselves are drawn, as dots; default false.
    pub draw_markers: bool,
    /// Largest number of nodes that a surface has at once, 1..=1000000; default 20000. In the plugin a hit that finds less than a
    /// quarter of them left freezes the oldest cracks: see
    /// [`CrackGrowth::remove_oldest`](super::CrackGrowth::remove_oldest).
    pub max_nodes: u32,
}

impl GrowthParams {
    /// The default: loose cracks as in concrete.
    pub const DEFAULT: Self = Self {
        kill_distance: 0.03,
        step_length: 0.02,
        crack_radius: 0.2,
        num_iterations: 200,
        num_lines_grid: 20,
        num_columns_grid: 20,
        markers: MarkerLayout::PseudoGrid { occupancy: 0.7, jitter: 0.8 },
        venation: Venation::Open,
        focus: 0.0,
        reach: 0.6,
        reach_variation: 0.0,
        starts: StartLayout::Point,
        line_width: 0.004,
        line_growth: 0.4,
        murray: 3.0,
        max_width: 0.03,
        tip_taper: 4.0,
        unevenness: 0.0,
        inertia: 0.0,
        axis: 0.0,
        directed: 0.0,
        wander: 0.1,
        grain: 0.0,
        zigzag: 0.0,
        forks: 0.0,
        fork_angle: 0.7,
        roughness: 0.12,
        draw_connections: false,
        connection_gaps: 0.3,
        connection_every: 1,
        draw_islands: false,
        island_distance: 0.03,
        open_ends: 0.0,
        arrest: 0.0,
        nucleation: 0.0,
        generations: 1,
        three_arm_share: 0.0,
        straightness: 0.0,
        thinning: 0.0,
        width_variation: 0.0,
        front: 0.0,
        patchiness: 0.0,
        variety: 0.0,
        courses: 0.0,
        distortion: 0.0,
        draw_markers: false,
        max_nodes: 20_000,
    };
}

impl Default for GrowthParams {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// A parameter that cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ParamError {
    /// A number is outside its range, or not finite.
    #[error("parameter `{name}` is {value}, must lie in {min}..={max}")]
    OutOfRange {
        /// Name of the field.
        name: &'static str,
        /// Its value.
        value: f64,
        /// Smallest value allowed.
        min: f64,
        /// Largest value allowed.
        max: f64,
    },
    /// No parameter has this name.
    #[error("there is no parameter `{name}`")]
    Unknown {
        /// The name asked for.
        name: String,
    },
    /// The text is not a value of the parameter.
    #[error("parameter `{name}` cannot be `{text}`")]
    Unreadable {
        /// Name of the field.
        name: String,
        /// The text given.
        text: String,
    },
}

/// The largest number of markers that a surface gets. A layout that needs more is truncated.
pub const MAX_MARKERS: usize = 262_144;

/// Share of `D²` by which the squared distance to a marker must decrease for a new node to count as progress towards
/// it.
pub(super) const PROGRESS: f32 = 0.25;

impl GrowthParams {
    /// Whether cracks must not cross.
    pub(super) fn keeps_apart(&self) -> bool {
        self.arrest > 0.0 || self.venation == Venation::Subdivision
    }

    /// Turns a direction towards the axis.
    pub(super) fn direct(&self, direction: Vec2) -> Vec2 {
        if self.directed <= 0.0 {
            return direction;
        }
        let axis = ops::unit(self.axis);
        let along = axis * axis.dot(direction);
        (along + (direction - along) * (1.0 - self.directed)).normalize_or(direction)
    }
}
