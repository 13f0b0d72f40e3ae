//! What is asked of a growth: [`GrowthParams`].

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
    /// Rays around the hit, with rings of markers on them (glass).
    Polar {
        /// Number of rays at the centre, 1..=360.
        sectors: u32,
        /// Number of rings, 1..=256.
        rings: u32,
        /// How much further apart each ring is than the one before, 0.5..=2.
        ring_growth: f32,
        /// Unevenness of angles and radii, 0..=1.
        jitter: f32,
        /// Probability that a place carries a marker, 0..=1.
        occupancy: f32,
    },
}

/// The nodes with which a hit begins.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "bevy", derive(bevy::reflect::Reflect))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub enum StartLayout {
    /// One node at the hit.
    Point,
    /// `count` nodes scattered over the reach of the hit.
    Points {
        /// 1..=1024.
        count: u32,
    },
    /// `count` nodes evenly on a circle around the hit.
    Ring {
        /// 1..=1024.
        count: u32,
        /// Pattern units, 0..=1.
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
    /// Distance at which a marker counts as reached and dies. Pattern units, 0.0005..=4.
    pub kill_distance: f32,
    /// Length of a segment: the distance `D` from a node to the node that grows from it. Pattern units, 0.001..=4.
    pub step_length: f32,
    /// How far a node attracts markers. Pattern units, 0.001..=32, at most 256 times [`step_length`](Self::step_length).
    pub crack_radius: f32,
    /// Steps of growth after each hit, 1..=100000.
    pub num_iterations: u32,
    /// Lines of the marker grid, 1..=1024.
    pub num_lines_grid: u32,
    /// Columns of the marker grid, 1..=1024.
    pub num_columns_grid: u32,
    /// How markers are laid out.
    pub markers: MarkerLayout,
    /// How much denser markers are near the hit: 0 = even, 4 = nearly all in the inner half. 0..=4.
    pub focus: f32,
    /// Radius around a hit of energy 1 that markers populate; grows with the root of the energy. Pattern units, 0.01..=64.
    pub reach: f32,
    /// The nodes with which a hit begins.
    pub starts: StartLayout,
    /// Width of a crack at its tip. Pattern units, 0.0005..=0.2.
    pub line_width: f32,
    /// How fast width grows with what hangs on a node; 0 = constant. 0..=16.
    pub line_growth: f32,
    /// Exponent of the pipe model: a node with `n` nodes behind it is as wide as `n^(1/murray)` tips. 1..=8.
    pub murray: f32,
    /// The widest a crack gets. Pattern units, at least `line_width`, at most 0.4.
    pub max_width: f32,
    /// How much the direction of growth strays at each node, radians, 0..=1.
    pub wander: f32,
    /// How rough the line between two nodes is, as a share of its length, 0..=0.5.
    pub roughness: f32,
    /// Whether nodes born of the same parent generation are joined (the rings of glass).
    pub draw_connections: bool,
    /// Share of possible connections that are left out, 0..=1.
    pub connection_gaps: f32,
    /// Every how many generations a ring of connections is drawn, 1..=1000.
    pub connection_every: u32,
    /// Whether close nodes of different branches are joined (the cells of clay).
    pub draw_islands: bool,
    /// How close they must be. Pattern units, 0..=1.
    pub island_distance: f32,
    /// Whether the markers themselves are drawn.
    pub draw_markers: bool,
    /// The most nodes that a surface gets, 1..=1000000.
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
        focus: 0.0,
        reach: 0.6,
        starts: StartLayout::Point,
        line_width: 0.004,
        line_growth: 0.4,
        murray: 3.0,
        max_width: 0.03,
        wander: 0.1,
        roughness: 0.12,
        draw_connections: false,
        connection_gaps: 0.3,
        connection_every: 1,
        draw_islands: false,
        island_distance: 0.03,
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
