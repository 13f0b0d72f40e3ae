//! The crushed zone around a hit: [`CrushedZone`].

/// The crushed zone around a hit. Its size depends on the energy of the hit. All details are computed from the seed
/// and the position, at any resolution.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "bevy", derive(bevy::reflect::Reflect))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields, default))]
pub struct CrushedZone {
    /// Radius at energy 1; it is proportional to the square root of the energy. Pattern units, 0..=0.5; default 0.03.
    pub radius: f32,
    /// How far the outline deviates from a circle, as a share of the radius. 0..=1; default 0.4.
    pub ragged: f32,
    /// How softly the zone ends: 0 = with a broken edge, 1 = it fades from the middle on. Default 0.
    pub soft: f32,
    /// Radius of the dark hole in the middle, as a share of the radius. 0..=1; default 0.
    pub hole: f32,
    /// Depth of the crater, pattern units, 0..=0.2; default 0.008.
    pub depth: f32,
    /// Height of the bumps on the floor, pattern units, 0..=0.05; default 0.002.
    pub rough: f32,
    /// Size of grains and crumbs, pattern units, 0.0005..=0.1; default 0.006.
    pub grain: f32,
    /// Colour of crushed material, dust and crumbs, sRGB 0..=1; default a light grey.
    pub color: [f32; 3],
    /// How much that colour covers the picture. 0..=1; default 0.5.
    pub pale: f32,
    /// How much the colour varies from grain to grain. 0..=1; default 0.4.
    pub speckle: f32,
    /// Distance to which a flat flake with arcs extends on one side (conchoidal fracture), radii. 0..=8; default 0 =
    /// none.
    pub flake: f32,
    /// How much dust covers the surroundings; it falls to nothing at [`reach`](Self::reach). 0..=1; default 0.2.
    pub dust: f32,
    /// How many crumbs lie around the zone, up to [`reach`](Self::reach); with a [`rim`](Self::rim) they are clods of up to two grains in radius.
    /// 0..=1; default 0.3.
    pub chips: f32,
    /// Distance to which dust and crumbs extend, radii. 1..=8; default 2.5.
    pub reach: f32,
    /// Whether the zone is broken along straight chords into plates, with angular chips that cast shadows. Else its
    /// outline and floor look crushed to powder. If `true`, [`soft`](Self::soft), [`hole`](Self::hole),
    /// [`flake`](Self::flake) and [`rim`](Self::rim) have no effect. Default false.
    pub broken: bool,
    /// Radius of the deeper hollow in the middle of a [`broken`](Self::broken) zone, as a share of the radius; it has
    /// more than half of the depth. 0..=1; default 0 = a flat floor.
    pub basin: f32,
    /// Number of terraces of a [`broken`](Self::broken) zone from its edge to the bottom, each inside the one before:
    /// the contours of a [`Crater`](crate::relief::Crater), in place of the [`basin`](Self::basin). From three on, the
    /// floor is a hollow around the hit as well, with powder on it, and more dust and larger chips lie around.
    /// 0..=4; default 0 = none.
    pub terraces: u32,
    /// Number of smaller flakes that have come off further out, for a [`broken`](Self::broken) zone at energy 1;
    /// proportional to the root of the energy. 0..=16; default 0.
    pub flakes: u32,
    /// Share of the picture's own colour in [`color`](Self::color), so that crushed material has the tone of the
    /// surface. 0..=1; default 0.
    pub tint: f32,
    /// How far the chips and dust of a [`broken`](Self::broken) zone lie below it (a wall): 0 = all around, 1 =
    /// nearly all below. 0..=1; default 0.
    pub fall: f32,
    /// Width of a dark line around the chips of a [`broken`](Self::broken) zone (a drawing), pattern units, 0..=0.05;
    /// default 0 = none.
    pub outline: f32,
    /// Radius of a drawn pit with straight sides in the middle of a [`broken`](Self::broken) zone, as a share of the
    /// radius. It is shown as part of [drawn](crate::paint::Cel) cracks with a [`slant`](crate::paint::Cel::slant).
    /// 0..=2; default 0 = none.
    pub pit: f32,
    /// Number of ink strokes behind the chips of a [`broken`](Self::broken) zone, two for each chip (a drawing).
    /// 0..=16; default 0.
    pub ticks: u32,
    /// How much of the zone consists of short radial and ring cracks with flakes between them, which thin out up to
    /// [`reach`](Self::reach), instead of powder with an outline (laminated glass, ice). 0..=1; default 0.
    pub needles: f32,
    /// How much of [`needles`](Self::needles) is a cloud of short cracks that cross each other, each with a small
    /// sheet to one side (ice), instead of radial ones. 0..=1; default 0.
    pub crazing: f32,
    /// Number of bubbles around the hit, in strings and clusters. 0..=64; default 0.
    pub bubbles: u32,
    /// Width of the broken edge around the hole, as a share of the hole. The hole has straight sides then and is less
    /// dark towards the edge. 0..=4; default 0 = none.
    pub edge: f32,
    /// How much cracks are hidden on the floor of a [`broken`](Self::broken) zone, or of one with a [`rim`](Self::rim): the material that they ran
    /// through is gone. 0..=1; default 0.
    pub bare: f32,
    /// How far the edge of a [`broken`](Self::broken) zone deviates from its chords, as in crumbling material. With
    /// it the wall has an uneven slope, and pieces are longer one way. Pattern units, 0..=0.05; default 0 = clean
    /// chords.
    pub jag: f32,
    /// Share of the floor of a [`broken`](Self::broken) zone that consists of rounded stones of several sizes in
    /// finer material (the aggregate of concrete); else it has one grain size. 0..=1; default 0.
    pub stones: f32,
    /// Height of the material that is thrown up around a zone that is not [`broken`](Self::broken), as a share of the depth, in rays that are higher and
    /// lower (loose material: sand, snow). It falls to nothing within [`reach`](Self::reach), at about 0.8 radii from the edge at the latest. With it the zone is
    /// a round bowl, whatever [`soft`](Self::soft) is, as steep at all energies: it is so deep at energy 1, and its depth grows as its radius does; a depth map shows the
    /// deepest of it as deep as at energy 1. 0..=1; default 0 = none.
    pub rim: f32,
}

impl CrushedZone {
    /// The default: a crater in stone.
    pub const DEFAULT: Self = Self {
        radius: 0.03,
        ragged: 0.4,
        soft: 0.0,
        hole: 0.0,
        depth: 0.008,
        rough: 0.002,
        grain: 0.006,
        color: [0.72, 0.70, 0.66],
        pale: 0.5,
        speckle: 0.4,
        flake: 0.0,
        dust: 0.2,
        chips: 0.3,
        reach: 2.5,
        broken: false,
        basin: 0.0,
        terraces: 0,
        flakes: 0,
        tint: 0.0,
        fall: 0.0,
        outline: 0.0,
        pit: 0.0,
        ticks: 0,
        needles: 0.0,
        crazing: 0.0,
        bubbles: 0,
        edge: 0.0,
        bare: 0.0,
        jag: 0.0,
        stones: 0.0,
        rim: 0.0,
    };

    /// The first field that is out of its range or not finite: its name, value and range.
    pub(crate) fn fault(&self) -> Option<(&'static str, f32, &'static str)> {
        let fields = [
            ("crushed.radius", self.radius, 0.0..=0.5, "0..=0.5"),
            ("crushed.ragged", self.ragged, 0.0..=1.0, "0..=1"),
            ("crushed.soft", self.soft, 0.0..=1.0, "0..=1"),
            ("crushed.hole", self.hole, 0.0..=1.0, "0..=1"),
            ("crushed.depth", self.depth, 0.0..=0.2, "0..=0.2"),
            ("crushed.rough", self.rough, 0.0..=0.05, "0..=0.05"),
            ("crushed.grain", self.grain, 0.0005..=0.1, "0.0005..=0.1"),
            ("crushed.color", self.color[0], 0.0..=1.0, "0..=1"),
            ("crushed.color", self.color[1], 0.0..=1.0, "0..=1"),
            ("crushed.color", self.color[2], 0.0..=1.0, "0..=1"),
            ("crushed.pale", self.pale, 0.0..=1.0, "0..=1"),
            ("crushed.speckle", self.speckle, 0.0..=1.0, "0..=1"),
            ("crushed.flake", self.flake, 0.0..=8.0, "0..=8"),
            ("crushed.dust", self.dust, 0.0..=1.0, "0..=1"),
            ("crushed.chips", self.chips, 0.0..=1.0, "0..=1"),
            ("crushed.reach", self.reach, 1.0..=8.0, "1..=8"),
            ("crushed.basin", self.basin, 0.0..=1.0, "0..=1"),
            ("crushed.terraces", self.terraces as f32, 0.0..=4.0, "0..=4"),
            ("crushed.flakes", self.flakes as f32, 0.0..=16.0, "0..=16"),
            ("crushed.tint", self.tint, 0.0..=1.0, "0..=1"),
            ("crushed.fall", self.fall, 0.0..=1.0, "0..=1"),
            ("crushed.outline", self.outline, 0.0..=0.05, "0..=0.05"),
            ("crushed.pit", self.pit, 0.0..=2.0, "0..=2"),
            ("crushed.ticks", self.ticks as f32, 0.0..=16.0, "0..=16"),
            ("crushed.needles", self.needles, 0.0..=1.0, "0..=1"),
            ("crushed.crazing", self.crazing, 0.0..=1.0, "0..=1"),
            ("crushed.bubbles", self.bubbles as f32, 0.0..=64.0, "0..=64"),
            ("crushed.edge", self.edge, 0.0..=4.0, "0..=4"),
            ("crushed.bare", self.bare, 0.0..=1.0, "0..=1"),
            ("crushed.jag", self.jag, 0.0..=0.05, "0..=0.05"),
            ("crushed.stones", self.stones, 0.0..=1.0, "0..=1"),
            ("crushed.rim", self.rim, 0.0..=1.0, "0..=1"),
        ];
        let is_bad = |(_, value, range, _): &(_, f32, std::ops::RangeInclusive<f32>, _)| !range.contains(value);
        fields.into_iter().find(is_bad).map(|(name, value, _, range)| (name, value, range))
    }

    /// The same zone at another scale: every length times `by`.
    pub(crate) fn scaled(&self, by: f32) -> Self {
        let scaled = |length: f32, low: f32, high: f32| (length * by).clamp(low, high);
        Self {
            radius: scaled(self.radius, 0.0, 0.5),
            depth: scaled(self.depth, 0.0, 0.2),
            rough: scaled(self.rough, 0.0, 0.05),
            grain: scaled(self.grain, 0.0005, 0.1),
            outline: scaled(self.outline, 0.0, 0.05),
            jag: scaled(self.jag, 0.0, 0.05),
            ..*self
        }
    }
}

impl Default for CrushedZone {
    fn default() -> Self {
        Self::DEFAULT
    }
}
