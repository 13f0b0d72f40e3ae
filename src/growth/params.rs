//! What is asked of a growth: [`GrowthParams`].

mod text;
mod vary;

use crate::math::ops;
use glam::Vec2;

/// How markers are laid out around a hit.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "bevy", derive(bevy::reflect::Reflect))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub enum MarkerLayout {
    /// The vertices of a grid of `num_lines_grid` x `num_columns_grid`, each with a given probability (Couto et al., 4.1).
    PseudoGrid {
        /// Probability that a vertex carries a marker, 0..=1.
        occupancy: f32,
        /// How far a marker strays from its vertex, as a share of the cell, 0..=1.
        jitter: f32,
    },
    /// Random points no closer than `spacing` to each other (Cook 1986; the way of Runions et al. 2005).
    DartThrowing {
        /// Least distance between markers, pattern units, 0.002..=1.
        spacing: f32,
    },
    /// Straight rays around the hit, each with markers of its own, which attract its nodes alone (glass, ice). They start on the rim
    /// of the crushed zone ([`StartLayout::Crushed`]), and with `draw_connections` rings join them: broken polygons, wider
    /// apart further out, as far as the reach. Where the border is near there are fewer of them.
    Rays {
        /// Number of rays of a hit of energy 1, 1..=360; in proportion to the energy to the power of 0.45.
        sectors: u32,
        /// Unevenness of angles and rings, and how much the rays kink, 0..=1.
        jitter: f32,
        /// Share of the rays that run on until they meet the border or another crack, 0..=1. The others end within the reach, most
        /// of them near the hit: at a ring if there are any, or free, which is the share [`open_ends`](GrowthParams::open_ends) of them.
        through: f32,
    },
}

/// How cracks share the markers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "bevy", derive(bevy::reflect::Reflect))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Venation {
    /// A marker attracts its nearest node and dies when it is reached: cracks branch, and do not come together.
    #[default]
    Open,
    /// A marker attracts all its relative neighbours and dies when each has reached it (Runions et al. 2005): cracks come together
    /// and close cells.
    Closed,
    /// Cracks do not branch. One begins where a marker is farthest from all older cracks, across the shorter way of the domain around it, and runs
    /// both ways, drawn by the markers ahead of its tips, until it meets older ones: each divides a domain, until all markers are within the kill
    /// distance of a crack. No two cross, as with [`arrest`](GrowthParams::arrest). [`nucleation`](GrowthParams::nucleation) is how many begin in
    /// each step, [`focus`](GrowthParams::focus) how much finer domains are near the hit; with [`open_ends`](GrowthParams::open_ends)
    /// at 0 even the ends that leave the reach of the hit run on until they meet something. Markers should lie closer than 0.7 kill distances.
    Dividing,
}

/// The nodes with which a hit begins.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "bevy", derive(bevy::reflect::Reflect))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub enum StartLayout {
    /// One node at the hit.
    Point,
    /// One node at the hit and others scattered over its reach, in proportion to its energy.
    Points {
        /// Nodes at energy 1, 1..=1024.
        count: u32,
    },
    /// One node at the hit and a segment from it for each of `count` arms, in proportion to the cube root of the energy, spread over the
    /// directions in which there is room: fewer where the border is near.
    Arms {
        /// Arms at energy 1, 1..=1024.
        count: u32,
    },
    /// `count` nodes evenly on a circle around the hit.
    Ring {
        /// 1..=1024.
        count: u32,
        /// Pattern units, 0..=1.
        radius: f32,
    },
    /// The rim of a crushed zone, whose inside is left to the picture: nodes on a circle around the hit, joined to each other. One for each
    /// ray that starts there with [`MarkerLayout::Rays`], else `count` of them, in proportion to the root of the energy.
    Crushed {
        /// Nodes on the rim at energy 1, 1..=1024.
        count: u32,
        /// Radius at energy 1, pattern units, 0..=1; goes with the fourth root of the energy.
        radius: f32,
    },
    /// `count` nodes scattered over a disc around the hit.
    Disc {
        /// 1..=1024.
        count: u32,
        /// Pattern units, 0..=1.
        radius: f32,
    },
}

/// Everything that a growth is told, besides its seed and its hits.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "bevy", derive(bevy::reflect::Reflect))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields, default))]
pub struct GrowthParams {
    /// Distance at which a marker counts as reached and dies. Pattern units, 0.0005..=4, at most [`crack_radius`](Self::crack_radius).
    pub kill_distance: f32,
    /// Length of a segment: the distance `D` from a node to the node that grows from it. Pattern units, 0.001..=4.
    pub step_length: f32,
    /// How far a node attracts markers. Pattern units, 0.001..=32, at most 256 times [`step_length`](Self::step_length).
    pub crack_radius: f32,
    /// Steps of growth after each hit, 1..=100000.
    pub num_iterations: u32,
    /// Lines of the marker grid on a square surface, 1..=512; on a higher one as many more, up to 4096.
    pub num_lines_grid: u32,
    /// Columns of the marker grid on a square surface, 1..=512; on a wider one as many more, up to 4096.
    pub num_columns_grid: u32,
    /// How markers are laid out.
    pub markers: MarkerLayout,
    /// How cracks share the markers.
    pub venation: Venation,
    /// How much denser markers and forks are near the hit: 0 = even, 4 = nearly all in the inner half. 0..=4.
    pub focus: f32,
    /// Radius around a hit of energy 1 that markers populate; grows with the root of the energy. Pattern units, 0.01..=64.
    pub reach: f32,
    /// How much less far a hit reaches in some directions than in others: up to this share of it, for markers that are not on rays. With
    /// [`Venation::Dividing`] it reaches unevenly anyway. 0..=0.9.
    pub uneven: f32,
    /// The nodes with which a hit begins.
    pub starts: StartLayout,
    /// Width of a crack at its tip. Pattern units, 0.0005..=0.2.
    pub line_width: f32,
    /// How fast width grows with what hangs on a node; 0 = not at all. With `n` nodes behind it, itself included, a node is
    /// `1 + line_growth (n^(1/murray) - 1)` times as wide as [`line_width`](Self::line_width). 0..=16.
    pub line_growth: f32,
    /// Exponent of the pipe model: at a `line_growth` of 1 a node with `n` nodes behind it is as wide as `n^(1/murray)` tips. 1..=8.
    pub murray: f32,
    /// The widest that what hangs on it makes a crack at energy 1. Pattern units, at least `line_width`, at most 0.4. All widths go with the
    /// fourth root of the energy: 16 makes them twice as wide.
    pub max_width: f32,
    /// Segments over which a free end narrows to a needle; an end that meets another crack does not. 0 = it is as wide as `line_width`. 0..=64.
    pub tip_taper: f32,
    /// How much the width varies along a crack, 0..=0.9: it is by up to this share narrower than without.
    pub unevenness: f32,
    /// How much a crack keeps its direction, against the pull of the markers: 0 = not at all, 1 = as much as it follows them. In
    /// what a [mask](crate::pattern::CrackMask) marks as weak it keeps less of it, or none: there the joint leads. 0..=8.
    pub inertia: f32,
    /// Direction in which cracks like to run, radians from the x axis (y runs down): across what pulls the surface apart. -7..=7.
    pub axis: f32,
    /// How much they keep to [`axis`](Self::axis): 0 = not at all, 1 = nearly straight along it. 0..=1.
    pub directed: f32,
    /// How much the direction of growth strays, radians, 0..=1.
    pub wander: f32,
    /// Size of the grains that cracks go round: within each a crack runs straight, and at its border it kinks by up to twice
    /// [`wander`](Self::wander). Pattern units, 0..=1; 0 = none, cracks stray at every node.
    pub grain: f32,
    /// How much cracks stray to the left and the right in turn, in place of at random (drawn cracks): 0 = not at all, 1 = at every node. They keep to
    /// their course besides. 0..=1.
    pub zigzag: f32,
    /// Share of nodes at which a tip forks, 0..=1: a side branch sets out ahead, if markers lie there; [`focus`](Self::focus) makes
    /// forks rarer away from the hit, as it does markers. Only with [`arrest`](Self::arrest). With
    /// [rays](MarkerLayout::Rays) it goes with the energy to the power of 0.6, forks fork again half as often, and the angle is 0.42 at least.
    pub forks: f32,
    /// Angle between the two ways of a fork, radians, 0.2..=1.6; each by up to a quarter more or less.
    pub fork_angle: f32,
    /// How rough the line between two nodes is, as a share of its length, 0..=0.5.
    pub roughness: f32,
    /// Whether nodes born of the same parent generation are joined (the rings of glass).
    pub draw_connections: bool,
    /// Share of possible connections that are left out, 0..=1.
    pub connection_gaps: f32,
    /// Generations to the first ring of connections; the next ones lie 2, 3, 4 ... times as far apart. 1..=1000.
    pub connection_every: u32,
    /// Whether close nodes of different branches are joined (the cells of clay).
    pub draw_islands: bool,
    /// How close they must be. Pattern units, 0..=1.
    pub island_distance: f32,
    /// How far a tip notices an older crack or the border ahead of it, pattern units, 0..=1: it turns to meet it steeply and
    /// stops there. No less than 2.5 segment lengths, which it needs to turn. No two cracks cross then. 0 = off: cracks neither see nor mind each other, as in the papers.
    pub arrest: f32,
    /// Share of tips that stop short of the crack that they would have met, 0..=1.
    pub open_ends: f32,
    /// Cracks that begin by themselves where markers are out of every crack's reach: how many for each step of growth, 0..=64.
    /// They come late, so they end at the older ones.
    pub nucleation: f32,
    /// With [`Venation::Dividing`]: cracks come in so many generations, each in domains that are 1.6 times smaller, and half as wide as the one
    /// before. 1..=4.
    pub generations: u32,
    /// With [`Venation::Dividing`]: share of the cracks that begin with three arms, 120 degrees apart, in place of two, where a domain is about as
    /// wide as long: more cells have five and six sides. 0..=1.
    pub stars: f32,
    /// With [`Venation::Dividing`]: how much cracks keep to the way in which they began, with kinks about it in place of bends, straight across the
    /// widest place of their domain: plates are polygons, and no two cracks meet a third from either side of one place. 0..=1; default 0.
    pub steady: f32,
    /// With [`Venation::Dividing`]: how much thinner cracks are towards the rim of what their hit has loaded, and how much larger domains: at 1
    /// there is next to nothing at the rim. 0..=1; default 0.
    pub thinning: f32,
    /// With [`Venation::Dividing`]: how much narrower than others of its generation a crack is at the most. 0..=0.9; default 0.
    pub mixed: f32,
    /// With [`Venation::Dividing`]: how far cracks may begin from the hit, pattern units for each step since it; 0 = anywhere at once. 0..=1.
    pub front: f32,
    /// With [`Venation::Dividing`]: how much larger domains are here and there, in patches of a few of them: up to so many times more than one. 0..=4.
    pub patches: f32,
    /// How much one surface differs from the next, by its seed: widths, roughness, the spacing of markers, the number of starts and
    /// of free ends, the axis. 0 = not at all; at 1 each differs by a factor of up to 2 either way, mostly much less. 0..=1.
    pub variety: f32,
    /// Height of the courses of bricks in whose joints cracks run, where the [mask](crate::pattern::CrackMask) shows no lines; where it shows
    /// courses of bricks, those. Then no crack is wider than a joint. Pattern units, 0..=1; 0 = the surface is no masonry.
    pub courses: f32,
    /// How far lines as a whole sway off their way, whatever that follows: uneven joints. Pattern units, 0..=0.05; 0 = not at all.
    pub sway: f32,
    /// Whether the markers themselves are drawn.
    pub draw_markers: bool,
    /// The most nodes that a surface has at once, 1..=1000000. In the engine a hit for which less than a quarter of them is left freezes
    /// the oldest: see [`CrackGrowth::forget_oldest`](super::CrackGrowth::forget_oldest).
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
        uneven: 0.0,
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
        stars: 0.0,
        steady: 0.0,
        thinning: 0.0,
        mixed: 0.0,
        front: 0.0,
        patches: 0.0,
        variety: 0.0,
        courses: 0.0,
        sway: 0.0,
        draw_markers: false,
        max_nodes: 20_000,
    };
}

impl Default for GrowthParams {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// A parameter that no growth can work with.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ParamError {
    /// A number outside its range, or not finite.
    #[error("parameter `{name}` is {value}, must lie in {min}..={max}")]
    OutOfRange {
        /// Name of the field.
        name: &'static str,
        /// Its value.
        value: f64,
        /// Least value allowed.
        min: f64,
        /// Greatest value allowed.
        max: f64,
    },
    /// No parameter has this name.
    #[error("there is no parameter `{name}`")]
    Unknown {
        /// The name asked for.
        name: String,
    },
    /// Text that is no value of the parameter.
    #[error("parameter `{name}` cannot be `{text}`")]
    Unreadable {
        /// Name of the field.
        name: String,
        /// The text given.
        text: String,
    },
}

/// The most markers that a surface gets; a layout that asks for more is cut short.
pub const MAX_MARKERS: usize = 262_144;

/// Share of `D²` by which the squared distance to a marker must fall for a node to have served it.
pub(super) const PROGRESS: f32 = 0.25;

impl GrowthParams {
    /// Whether cracks must not cross.
    pub(super) fn keeps_apart(&self) -> bool {
        self.arrest > 0.0 || self.venation == Venation::Dividing
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
