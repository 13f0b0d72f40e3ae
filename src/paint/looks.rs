//! The looks of the presets.

use super::{Cel, Facets, Look, look::stop};
use crate::raster::{CrushedZone, Veil};
use std::borrow::Cow;

impl Look {
    /// Window glass: bright hairlines, plates that reflect and displace what is behind them, and a white crushed ring
    /// around a hole.
    pub const GLASS: Self = Self {
        ramp: Cow::Borrowed(&[
            stop(0.05, [0.84, 0.90, 0.91], 0.14),
            stop(0.18, [0.88, 0.93, 0.94], 0.33),
            stop(0.40, [0.93, 0.97, 0.97], 0.55),
            stop(0.75, [0.97, 0.99, 1.0], 0.85),
            stop(1.0, [0.98, 1.0, 1.0], 0.95),
        ]),
        glint: 0.42,
        sparkle: 0.5,
        directionality: 0.8,
        facets: Some(Facets {
            tone: 0.11,
            tilt: 0.20,
            shift: 3.0,
            reflection: 0.75,
            bright_share: 0.22,
            falloff: 0.5,
            patch_share: 0.3,
            ..Facets::DEFAULT
        }),
        crushed: Some(CrushedZone {
            radius: 0.026,
            ragged: 0.9,
            soft: 0.75,
            hole: 0.65,
            depth: 0.001,
            rough: 0.0006,
            grain: 0.0035,
            color: [0.95, 0.98, 1.0],
            pale: 0.95,
            speckle: 0.5,
            dust: 0.2,
            chips: 0.0,
            reach: 2.6,
            needles: 0.7,
            edge: 0.9,
            ..CrushedZone::DEFAULT
        }),
        ..Self::FROSTED
    };

    /// Tempered glass: dice with different tones and reflections.
    pub const TEMPERED_GLASS: Self = Self {
        ramp: Cow::Borrowed(&[
            stop(0.10, [0.86, 0.92, 0.92], 0.10),
            stop(0.45, [0.90, 0.96, 0.95], 0.45),
            stop(1.0, [0.95, 0.99, 0.98], 0.80),
        ]),
        glint: 0.3,
        sparkle: 0.45,
        directionality: 0.5,
        relief: 0.001,
        facets: Some(Facets {
            tone: 0.22,
            tilt: 0.22,
            shift: 3.0,
            reflection: 0.9,
            bright_share: 0.09,
            falloff: 0.2,
            similarity: 0.4,
            missing_whole: true,
            patch_share: 0.45,
            thickness: 0.011,
            ..Facets::DEFAULT
        }),
        crushed: Some(CrushedZone {
            radius: 0.03,
            ragged: 0.6,
            soft: 0.8,
            hole: 0.7,
            depth: 0.001,
            rough: 0.0003,
            grain: 0.0075,
            color: [0.95, 0.98, 1.0],
            pale: 0.75,
            speckle: 0.5,
            flake: 0.0,
            dust: 0.15,
            chips: 0.35,
            reach: 3.5,
            ..CrushedZone::DEFAULT
        }),
        ..Self::FROSTED
    };

    /// Laminated glass: a milky disc, lines whose brightness varies along them, plates that stay in place.
    pub const LAMINATED_GLASS: Self = Self {
        glint: 0.45,
        sparkle: 0.55,
        directionality: 0.8,
        facets: Some(Facets {
            tone: 0.06,
            tilt: 0.05,
            shift: 1.0,
            reflection: 0.30,
            bright_share: 0.12,
            falloff: 0.8,
            ..Facets::DEFAULT
        }),
        crushed: Some(CrushedZone {
            radius: 0.045,
            ragged: 0.9,
            soft: 0.6,
            depth: 0.0,
            rough: 0.0014,
            grain: 0.0045,
            color: [0.95, 0.98, 0.99],
            pale: 1.0,
            speckle: 0.9,
            dust: 0.25,
            chips: 0.0,
            reach: 2.2,
            needles: 0.35,
            crazing: 0.3,
            ..CrushedZone::DEFAULT
        }),
        ..Self::FROSTED
    };

    /// Ice: bright lines, and a white spot with bubbles around the hit.
    pub const ICE: Self = Self {
        ramp: Cow::Borrowed(&[
            stop(0.06, [0.34, 0.41, 0.46], 0.0),
            stop(0.14, [0.34, 0.41, 0.46], 0.26),
            stop(0.26, [0.80, 0.88, 0.92], 0.20),
            stop(0.55, [0.92, 0.97, 1.0], 0.62),
            stop(1.0, [0.98, 1.0, 1.0], 0.95),
        ]),
        gloss: 0.6,
        glint: 0.5,
        uneven_glint: 0.5,
        sparkle: 0.6,
        directionality: 0.75,
        veil: Some(Veil {
            reach: 0.16,
            full_width: 0.005,
            cover: 0.8,
            color: [0.88, 0.95, 1.0],
            variation: 0.55,
            bubbles: 0.04,
        }),
        facets: Some(Facets {
            tone: 0.07,
            tilt: 0.03,
            shift: 2.0,
            reflection: 0.18,
            bright_share: 0.12,
            reflection_color: [0.85, 0.95, 1.0],
            falloff: 0.2,
            ..Facets::DEFAULT
        }),
        crushed: Some(CrushedZone {
            radius: 0.05,
            ragged: 0.9,
            soft: 1.0,
            depth: 0.0,
            rough: 0.0014,
            grain: 0.005,
            color: [0.95, 0.98, 1.0],
            pale: 0.95,
            speckle: 0.5,
            dust: 0.15,
            chips: 0.0,
            reach: 2.6,
            needles: 0.8,
            crazing: 0.5,
            bubbles: 4,
            ..CrushedZone::DEFAULT
        }),
        ..Self::FROSTED
    };

    /// Concrete: grey-brown cracks, and a spalled crater with paler aggregate, crumbs and dust.
    pub const CONCRETE: Self = Self {
        ramp: Cow::Borrowed(&[
            stop(0.08, [0.60, 0.575, 0.55], 0.0),
            stop(0.30, [0.42, 0.39, 0.36], 0.85),
            stop(0.70, [0.26, 0.24, 0.22], 0.97),
            stop(1.0, [0.13, 0.117, 0.105], 1.0),
        ]),
        crushed: Some(CrushedZone {
            radius: 0.040,
            ragged: 0.7,
            depth: 0.025,
            rough: 0.005,
            grain: 0.008,
            color: [0.57, 0.53, 0.48],
            pale: 0.85,
            speckle: 0.55,
            dust: 0.3,
            chips: 0.6,
            reach: 2.6,
            broken: true,
            basin: 0.6,
            terraces: 3,
            flakes: 2,
            tint: 0.75,
            fall: 0.5,
            bare: 1.0,
            jag: 0.003,
            stones: 0.7,
            ..CrushedZone::DEFAULT
        }),
        glint: 2.0,
        uneven_glint: 0.65,
        shadow: 1.0,
        cast: 1.6,
        relief: 0.009,
        ..Self::GROOVE
    };

    /// Asphalt: dark gaps between stones, with a worn edge.
    pub const ASPHALT: Self = Self {
        ramp: Cow::Borrowed(&[
            stop(0.10, [0.62, 0.60, 0.58], 0.15),
            stop(0.40, [0.36, 0.34, 0.32], 0.90),
            stop(1.0, [0.12, 0.11, 0.10], 1.0),
        ]),
        crushed: Some(CrushedZone {
            radius: 0.036,
            ragged: 0.7,
            depth: 0.022,
            rough: 0.004,
            grain: 0.01,
            color: [0.47, 0.45, 0.42],
            pale: 0.8,
            speckle: 0.8,
            dust: 0.2,
            chips: 1.0,
            reach: 3.0,
            broken: true,
            basin: 0.5,
            terraces: 3,
            tint: 0.7,
            fall: 0.4,
            bare: 1.0,
            jag: 0.003,
            stones: 1.0,
            ..CrushedZone::DEFAULT
        }),
        glint: 0.8,
        uneven_glint: 0.9,
        shadow: 0.9,
        cast: 1.4,
        relief: 0.008,
        grain: 0.2,
        ..Self::GROOVE
    };

    /// Marble: fine, sharp lines.
    pub const MARBLE: Self = Self {
        ramp: Cow::Borrowed(&[
            stop(0.15, [0.72, 0.71, 0.69], 0.20),
            stop(0.50, [0.32, 0.31, 0.30], 0.92),
            stop(1.0, [0.14, 0.13, 0.12], 1.0),
        ]),
        crushed: Some(CrushedZone {
            radius: 0.04,
            ragged: 0.6,
            depth: 0.011,
            rough: 0.003,
            grain: 0.005,
            color: [0.92, 0.915, 0.905],
            pale: 0.9,
            speckle: 0.2,
            dust: 0.25,
            chips: 0.5,
            reach: 2.8,
            broken: true,
            basin: 0.5,
            terraces: 3,
            flakes: 2,
            tint: 0.15,
            fall: 0.6,
            bare: 1.0,
            jag: 0.002,
            ..CrushedZone::DEFAULT
        }),
        glint: 0.75,
        uneven_glint: 0.85,
        shadow: 0.6,
        cast: 1.6,
        relief: 0.004,
        grain: 0.05,
        ..Self::GROOVE
    };

    /// Sand: a bowl with a raised rim at the hit, clods around it, and cracks whose sides have slumped.
    pub const SAND: Self = Self {
        ramp: Cow::Borrowed(&[
            stop(0.10, [0.97, 0.94, 0.90], 0.05),
            stop(0.40, [0.84, 0.78, 0.71], 0.65),
            stop(0.75, [0.60, 0.52, 0.44], 0.90),
            stop(1.0, [0.40, 0.325, 0.26], 0.97),
        ]),
        crushed: Some(CrushedZone {
            radius: 0.06,
            ragged: 0.2,
            soft: 1.0,
            depth: 0.025,
            rim: 0.85,
            rough: 0.0012,
            grain: 0.0024,
            color: [0.80, 0.68, 0.50],
            pale: 0.95,
            speckle: 0.12,
            dust: 0.3,
            chips: 0.6,
            reach: 2.6,
            tint: 0.9,
            bare: 1.0,
            ..CrushedZone::DEFAULT
        }),
        glint: 1.0,
        uneven_glint: 0.4,
        shadow: 1.0,
        cast: 1.4,
        relief: 0.016,
        grain: 0.25,
        ..Self::GROOVE
    };

    /// Plaster: thin cracks, and flakes that have come off around the hit and show the darker coat below.
    pub const PLASTER: Self = Self {
        ramp: Cow::Borrowed(&[
            stop(0.12, [0.60, 0.56, 0.52], 0.05),
            stop(0.45, [0.44, 0.40, 0.36], 0.80),
            stop(0.75, [0.27, 0.235, 0.20], 0.96),
            stop(1.0, [0.14, 0.12, 0.10], 1.0),
        ]),
        relief: 0.006,
        glint: 0.7,
        uneven_glint: 0.8,
        shadow: 0.9,
        cast: 1.6,
        crushed: Some(CrushedZone {
            radius: 0.042,
            ragged: 0.6,
            depth: 0.016,
            rough: 0.002,
            grain: 0.0068,
            color: [0.62, 0.54, 0.45],
            pale: 0.9,
            speckle: 0.3,
            dust: 0.2,
            chips: 0.6,
            reach: 3.0,
            broken: true,
            terraces: 1,
            flakes: 3,
            tint: 0.5,
            fall: 0.85,
            bare: 1.0,
            jag: 0.0018,
            stones: 0.25,
            ..CrushedZone::DEFAULT
        }),
        facets: Some(Facets { tone: 0.035, tilt: 0.025, fade: 0.3, ..Facets::DEFAULT }),
        ..Self::GROOVE
    };

    /// Brick: cracks where the mortar is missing, and a corner chipped off at the hit.
    pub const BRICK: Self = Self {
        ramp: Cow::Borrowed(&[
            stop(0.10, [0.58, 0.53, 0.48], 0.0),
            stop(0.35, [0.42, 0.38, 0.34], 0.85),
            stop(0.70, [0.28, 0.245, 0.22], 0.97),
            stop(1.0, [0.17, 0.145, 0.13], 1.0),
        ]),
        crushed: Some(CrushedZone {
            radius: 0.045,
            ragged: 0.75,
            depth: 0.024,
            rough: 0.006,
            grain: 0.005,
            color: [0.67, 0.43, 0.33],
            pale: 1.0,
            speckle: 0.6,
            dust: 0.4,
            chips: 0.5,
            reach: 3.0,
            broken: true,
            basin: 0.3,
            terraces: 2,
            flakes: 3,
            tint: 0.35,
            fall: 0.8,
            bare: 1.0,
            jag: 0.0018,
            ..CrushedZone::DEFAULT
        }),
        glint: 1.0,
        uneven_glint: 0.9,
        shadow: 0.9,
        cast: 1.4,
        facets: Some(Facets { tone: 0.10, tilt: 0.05, shift: 2.0, fade: 0.2, ..Facets::DEFAULT }),
        ..Self::GROOVE
    };

    /// A drawn crack: an ink line that ends in points, flat dark inside, one lit wall; loose chips around the hit.
    pub const TOON: Self = Self {
        tint: 0.0,
        glint: 0.0,
        grain: 0.0,
        relief: 0.02,
        opaque: true,
        cel: Some(Cel {
            outline: 0.0046,
            wall: 0.018,
            slant: 0.8,
            ink: [0.055, 0.04, 0.05],
            fill: [0.10, 0.065, 0.07],
            lit: [0.60, 0.40, 0.29],
            ..Cel::DEFAULT
        }),
        crushed: Some(CrushedZone {
            radius: 0.055,
            ragged: 0.3,
            depth: 0.0,
            rough: 0.0,
            grain: 0.024,
            color: [1.0, 0.95, 0.88],
            pale: 0.0,
            speckle: 0.0,
            dust: 0.0,
            chips: 0.13,
            reach: 2.8,
            broken: true,
            tint: 0.65,
            outline: 0.0026,
            pit: 0.8,
            ticks: 4,
            ..CrushedZone::DEFAULT
        }),
        ..Self::GROOVE
    };

    /// Clay: flat plates of slightly different tones, brown hairlines and cracks between them, a pale dent at the
    /// hit.
    pub const CLAY: Self = Self {
        ramp: Cow::Borrowed(&[
            stop(0.085, [1.0, 0.97, 0.92], 0.03),
            stop(0.22, [0.74, 0.67, 0.59], 0.60),
            stop(0.55, [0.50, 0.42, 0.34], 0.92),
            stop(1.0, [0.20, 0.155, 0.12], 1.0),
        ]),
        glint: 1.2,
        uneven_glint: 0.9,
        shadow: 0.9,
        cast: 1.2,
        relief: 0.007,
        curl: 0.08,
        curl_depth: 0.08,
        full_rim: 0.008,
        facets: Some(Facets { tone: 0.05, tilt: 0.03, concavity: 0.13, fade: 0.33, ..Facets::DEFAULT }),
        crushed: Some(CrushedZone {
            radius: 0.038,
            ragged: 0.7,
            depth: 0.02,
            rough: 0.003,
            grain: 0.008,
            color: [0.62, 0.47, 0.34],
            pale: 0.9,
            speckle: 0.3,
            dust: 0.3,
            chips: 0.6,
            reach: 2.6,
            broken: true,
            basin: 0.6,
            terraces: 3,
            flakes: 1,
            tint: 0.6,
            fall: 0.5,
            bare: 1.0,
            jag: 0.003,
            stones: 0.25,
            ..CrushedZone::DEFAULT
        }),
        ..Self::GROOVE
    };

    /// Mud: dished plates of different tones with curled rims, deep brown gaps with one wall lit and one in shadow, a
    /// dark dent at the hit.
    pub const MUD: Self = Self {
        ramp: Cow::Borrowed(&[
            stop(0.085, [0.85, 0.79, 0.72], 0.02),
            stop(0.20, [0.70, 0.645, 0.58], 0.45),
            stop(0.40, [0.46, 0.41, 0.355], 0.94),
            stop(0.60, [0.28, 0.23, 0.185], 0.98),
            stop(0.82, [0.16, 0.12, 0.09], 1.0),
            stop(1.0, [0.11, 0.08, 0.06], 1.0),
        ]),
        glint: 1.2,
        uneven_glint: 0.9,
        shadow: 0.9,
        cast: 0.8,
        relief: 0.024,
        curl: 0.12,
        curl_depth: 0.08,
        full_rim: 0.034,
        facets: Some(Facets { tone: 0.08, tilt: 0.10, concavity: 0.30, fade: 0.38, ..Facets::DEFAULT }),
        crushed: Some(CrushedZone {
            radius: 0.046,
            ragged: 0.7,
            depth: 0.034,
            rough: 0.0035,
            grain: 0.01,
            color: [0.44, 0.37, 0.295],
            pale: 0.9,
            speckle: 0.4,
            dust: 0.2,
            chips: 0.6,
            reach: 2.4,
            broken: true,
            basin: 0.7,
            terraces: 3,
            flakes: 1,
            tint: 0.7,
            fall: 0.5,
            bare: 1.0,
            jag: 0.004,
            stones: 0.15,
            ..CrushedZone::DEFAULT
        }),
        ..Self::GROOVE
    };

    /// The glaze of pottery: hairlines stained with ink, darker the wider they are, under a gloss.
    pub const STAIN: Self = Self {
        ramp: Cow::Borrowed(&[
            stop(0.20, [0.30, 0.24, 0.20], 0.30),
            stop(0.50, [0.22, 0.17, 0.14], 0.65),
            stop(1.0, [0.12, 0.09, 0.07], 0.88),
        ]),
        glint: 0.3,
        uneven_glint: 0.9,
        gloss: 0.5,
        grain: 0.08,
        sparkle: 0.5,
        directionality: 0.45,
        relief: 0.0008,
        facets: Some(Facets {
            tone: 0.004,
            tilt: 0.03,
            reflection: 0.2,
            bright_share: 0.3,
            reflection_color: [1.0; 3],
            similarity: 1.0,
            patch_share: 1.0,
            fade: 0.22,
            ..Facets::DEFAULT
        }),
        crushed: Some(CrushedZone {
            radius: 0.02,
            ragged: 0.6,
            depth: 0.0075,
            rough: 0.0004,
            grain: 0.006,
            color: [0.84, 0.77, 0.67],
            pale: 0.8,
            speckle: 0.25,
            dust: 0.0,
            chips: 0.1,
            reach: 2.6,
            broken: true,
            flakes: 1,
            tint: 0.35,
            bare: 1.0,
            jag: 0.0,
            ..CrushedZone::DEFAULT
        }),
        ..Self::GROOVE
    };

    /// A mirror: each piece reflects something different.
    pub const MIRROR: Self = Self {
        facets: Some(Facets {
            tone: 0.20,
            tilt: 0.16,
            shift: 9.0,
            reflection: 0.40,
            bright_share: 0.22,
            falloff: 0.25,
            ..Facets::DEFAULT
        }),
        sparkle: 0.2,
        ..Self::GLASS
    };

    /// Light that shines out of the cracks: lava, magic. It is in the emissive map too.
    pub const GLOWING: Self = Self {
        ramp: Cow::Borrowed(&[
            stop(0.10, [0.30, 0.10, 0.05], 0.20),
            stop(0.35, [0.55, 0.10, 0.02], 0.85),
            stop(0.60, [1.0, 0.42, 0.08], 1.0),
            stop(1.0, [1.0, 0.92, 0.55], 1.0),
        ]),
        tint: 0.0,
        glint: 0.25,
        grain: 0.05,
        sparkle: 0.25,
        glow: Cow::Borrowed(&[
            stop(0.10, [0.45, 0.06, 0.0], 0.25),
            stop(0.40, [0.90, 0.22, 0.02], 0.85),
            stop(1.0, [1.0, 0.75, 0.30], 1.0),
        ]),
        ..Self::GROOVE
    };
}
