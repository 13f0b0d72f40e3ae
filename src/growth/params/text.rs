//! The ranges of parameters, and setting parameters from text.

use super::{GrowthParams, MarkerLayout, ParamError, StartLayout, Venation};
use crate::strands::{StrandError, StrandParams};

macro_rules! fields {
    ($($name:ident: $kind:ty = $min:expr, $max:expr;)*) => {
        /// All plain numbers of the parameters with their ranges.
        pub(crate) fn ranges(&self) -> impl Iterator<Item = (&'static str, f64, f64, f64)> {
            [$((stringify!($name), f64::from(self.$name), $min, $max)),*].into_iter()
        }

        fn set_number(&mut self, name: &str, text: &str) -> Option<Result<(), ParamError>> {
            match name {
                $(stringify!($name) => Some(parse(name, text).map(|value: $kind| self.$name = value)),)*
                _ => None,
            }
        }
    };
}

fn parse<T: std::str::FromStr>(name: &str, text: &str) -> Result<T, ParamError> {
    text.trim().parse().map_err(|_| ParamError::Unreadable { name: name.to_owned(), text: text.to_owned() })
}

/// An error of setting a number of strands as one of the growth; `asked` is the name that was to be set.
fn of_strands(error: StrandError, asked: &str) -> ParamError {
    match error {
        StrandError::OutOfRange { value, .. } => {
            ParamError::Unreadable { name: asked.to_owned(), text: value.to_string() }
        }
        StrandError::Unreadable { text, .. } => ParamError::Unreadable { name: asked.to_owned(), text },
        _ => ParamError::Unknown { name: asked.to_owned() },
    }
}

impl GrowthParams {
    fields! {
        kill_distance: f32 = 0.0005, 4.0;
        step_length: f32 = 0.001, 4.0;
        crack_radius: f32 = 0.001, 32.0;
        num_iterations: u32 = 1.0, 100_000.0;
        num_lines_grid: u32 = 1.0, 512.0;
        num_columns_grid: u32 = 1.0, 512.0;
        focus: f32 = 0.0, 4.0;
        reach: f32 = 0.01, 64.0;
        reach_variation: f32 = 0.0, 0.9;
        line_width: f32 = 0.0005, 0.2;
        line_growth: f32 = 0.0, 16.0;
        murray: f32 = 1.0, 8.0;
        max_width: f32 = 0.0005, 0.4;
        tip_taper: f32 = 0.0, 64.0;
        unevenness: f32 = 0.0, 0.9;
        inertia: f32 = 0.0, 8.0;
        axis: f32 = -7.0, 7.0;
        directed: f32 = 0.0, 1.0;
        wander: f32 = 0.0, 1.0;
        grain: f32 = 0.0, 1.0;
        zigzag: f32 = 0.0, 1.0;
        forks: f32 = 0.0, 1.0;
        fork_angle: f32 = 0.2, 1.6;
        roughness: f32 = 0.0, 0.5;
        connection_gaps: f32 = 0.0, 1.0;
        connection_every: u32 = 1.0, 1000.0;
        island_distance: f32 = 0.0, 1.0;
        open_ends: f32 = 0.0, 1.0;
        arrest: f32 = 0.0, 1.0;
        nucleation: f32 = 0.0, 64.0;
        generations: u32 = 1.0, 4.0;
        three_arm_share: f32 = 0.0, 1.0;
        straightness: f32 = 0.0, 1.0;
        thinning: f32 = 0.0, 1.0;
        width_variation: f32 = 0.0, 0.9;
        front: f32 = 0.0, 1.0;
        patchiness: f32 = 0.0, 4.0;
        variety: f32 = 0.0, 1.0;
        courses: f32 = 0.0, 1.0;
        distortion: f32 = 0.0, 0.05;
        max_nodes: u32 = 1.0, 1_000_000.0;
    }

    /// Checks every parameter against its range.
    ///
    /// ```
    /// use bevy_crack::growth::GrowthParams;
    ///
    /// let error = GrowthParams { wander: 2.0, ..GrowthParams::DEFAULT }.validate().unwrap_err();
    /// assert_eq!(error.to_string(), "parameter `wander` is 2, must lie in 0..=1");
    /// ```
    ///
    /// # Errors
    /// [`ParamError::OutOfRange`] for the first parameter that is out of its range or not finite.
    pub fn validate(&self) -> Result<(), ParamError> {
        let markers: &[_] = match self.markers {
            MarkerLayout::PseudoGrid { occupancy, jitter } => {
                &[("occupancy", f64::from(occupancy), 0.0, 1.0), ("jitter", f64::from(jitter), 0.0, 1.0)]
            }
            MarkerLayout::DartThrowing { spacing } => &[("spacing", f64::from(spacing), 0.002, 1.0)],
            MarkerLayout::Rays { sectors, jitter, through } => &[
                ("sectors", f64::from(sectors), 1.0, 360.0),
                ("jitter", f64::from(jitter), 0.0, 1.0),
                ("through", f64::from(through), 0.0, 1.0),
            ],
            MarkerLayout::Strands { count, strands } => {
                if let Some((name, value, min, max)) = strands.out_of_range() {
                    let [value, min, max] = [value, min, max].map(f64::from);
                    return Err(ParamError::OutOfRange { name, value, min, max });
                }
                &[("strand_count", f64::from(count), 1.0, 1024.0)]
            }
        };
        let starts: &[_] = match self.starts {
            StartLayout::Point => &[],
            StartLayout::Points { count } | StartLayout::Arms { count } => {
                &[("start_count", f64::from(count), 1.0, 1024.0)]
            }
            StartLayout::Ring { count, radius }
            | StartLayout::Crushed { count, radius }
            | StartLayout::Disc { count, radius } => {
                &[("start_count", f64::from(count), 1.0, 1024.0), ("start_radius", f64::from(radius), 0.0, 1.0)]
            }
        };
        let related = [
            ("kill_distance", f64::from(self.kill_distance), 0.0005, f64::from(self.crack_radius)),
            ("crack_radius", f64::from(self.crack_radius), 0.0, 256.0 * f64::from(self.step_length)),
            ("max_width", f64::from(self.max_width), f64::from(self.line_width), 0.4),
        ];
        let all = self.ranges().chain(markers.iter().copied()).chain(starts.iter().copied()).chain(related);
        for (name, value, min, max) in all {
            // Compared in single precision: `0.01_f32` is a little less than `0.01_f64`.
            if !(min as f32..=max as f32).contains(&(value as f32)) {
                return Err(ParamError::OutOfRange { name, value, min, max });
            }
        }
        Ok(())
    }

    /// Sets one parameter from text, by the name of its field or by the name in the paper (`D`).
    ///
    /// These names are accepted in addition to the fields: `markers` (`grid`, `darts`, `rays`, `strands`); `occupancy`,
    /// `jitter`, `spacing`, `sectors`, `through`, `strand_count` and `strands.` with a name of
    /// [`StrandParams::set`](crate::strands::StrandParams::set), of the current layout; `venation` (`open`, `closed`, `dividing`);
    /// `starts` (`point`, `points`, `arms`, `ring`, `crushed`, `disc`); `start_count`, `start_radius`.
    ///
    /// ```
    /// use bevy_crack::growth::GrowthParams;
    ///
    /// let mut params = GrowthParams::default();
    /// params.set("D", "0.05")?;
    /// assert_eq!(params.step_length, 0.05);
    /// assert!(params.set("colour", "red").is_err());
    /// # Ok::<(), bevy_crack::growth::ParamError>(())
    /// ```
    ///
    /// # Errors
    /// [`ParamError::Unknown`] if there is no such parameter, [`ParamError::Unreadable`] if the text is not a value
    /// of it. Ranges are not checked here but by [`validate`](Self::validate).
    pub fn set(&mut self, name: &str, text: &str) -> Result<(), ParamError> {
        let unreadable = || ParamError::Unreadable { name: name.to_owned(), text: text.to_owned() };
        if let Some(done) = self.set_number(name, text) {
            return done;
        }
        match (name, &mut self.markers, &mut self.starts) {
            ("D", ..) => self.step_length = parse(name, text)?,
            ("draw_connections", ..) => self.draw_connections = parse(name, text)?,
            ("draw_islands", ..) => self.draw_islands = parse(name, text)?,
            ("draw_markers", ..) => self.draw_markers = parse(name, text)?,
            ("markers", ..) => {
                self.markers = match text {
                    "grid" => MarkerLayout::PseudoGrid { occupancy: 0.7, jitter: 0.8 },
                    "darts" => MarkerLayout::DartThrowing { spacing: 0.04 },
                    "rays" => MarkerLayout::Rays { sectors: 14, jitter: 0.6, through: 0.8 },
                    "strands" => MarkerLayout::Strands { count: 5, strands: StrandParams::ASPHALT },
                    _ => return Err(unreadable()),
                }
            }
            ("venation", ..) => {
                self.venation = match text {
                    "open" => Venation::Open,
                    "closed" => Venation::Closed,
                    "dividing" => Venation::Subdivision,
                    _ => return Err(unreadable()),
                }
            }
            ("starts", ..) => {
                self.starts = match text {
                    "point" => StartLayout::Point,
                    "points" => StartLayout::Points { count: 8 },
                    "arms" => StartLayout::Arms { count: 5 },
                    "ring" => StartLayout::Ring { count: 12, radius: 0.02 },
                    "crushed" => StartLayout::Crushed { count: 16, radius: 0.02 },
                    "disc" => StartLayout::Disc { count: 12, radius: 0.03 },
                    _ => return Err(unreadable()),
                }
            }
            ("occupancy", MarkerLayout::PseudoGrid { occupancy, .. }, _) => *occupancy = parse(name, text)?,
            ("jitter", MarkerLayout::PseudoGrid { jitter, .. } | MarkerLayout::Rays { jitter, .. }, _) => {
                *jitter = parse(name, text)?;
            }
            ("spacing", MarkerLayout::DartThrowing { spacing }, _) => *spacing = parse(name, text)?,
            ("sectors", MarkerLayout::Rays { sectors, .. }, _) => {
                *sectors = parse(name, text)?;
            }
            ("through", MarkerLayout::Rays { through, .. }, _) => *through = parse(name, text)?,
            ("strand_count", MarkerLayout::Strands { count, .. }, _) => *count = parse(name, text)?,
            (_, MarkerLayout::Strands { strands, .. }, _) if name.starts_with("strands.") => {
                let number = name.trim_start_matches("strands.");
                strands.set(number, text).map_err(|error| of_strands(error, name))?;
            }
            (
                "start_count",
                _,
                StartLayout::Points { count }
                | StartLayout::Arms { count }
                | StartLayout::Ring { count, .. }
                | StartLayout::Crushed { count, .. }
                | StartLayout::Disc { count, .. },
            ) => *count = parse(name, text)?,
            (
                "start_radius",
                _,
                StartLayout::Ring { radius, .. }
                | StartLayout::Crushed { radius, .. }
                | StartLayout::Disc { radius, .. },
            ) => {
                *radius = parse(name, text)?;
            }
            _ => return Err(ParamError::Unknown { name: name.to_owned() }),
        }
        Ok(())
    }
}
