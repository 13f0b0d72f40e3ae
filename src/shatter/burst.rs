//! [`Burst`]: the flight of pieces as a function of time.

use super::{Floor, ShardShape, ShatterError, cuts::in_range, floor::Landing};
use crate::math::{
    Rng, ops,
    turns::{after, turned},
};
use glam::{Quat, Vec2, Vec3};

/// How a burst looks. Lengths are pattern units, times are seconds.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "bevy", derive(bevy::reflect::Reflect))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields, default))]
pub struct BurstParams {
    /// Time before the cracked surface bursts, 0..=60. Default: 0.15.
    pub hold: f32,
    /// Speed at which the release runs outward from the hit, 0.01..=1000. Default: 8.
    pub front: f32,
    /// Speed of pieces at a hit of energy 1, 0..=100; it is proportional to the root of the energy. Default: 0.9.
    pub speed: f32,
    /// Distance from the hit at which a piece gets half the speed, 0.001..=64. Default: 0.5.
    pub falloff: f32,
    /// Share of the speed in the direction of the hit instead of away from it, 0..=1. Default: 0.5.
    pub along: f32,
    /// Randomness of speeds and directions, 0..=1. Default: 0.35.
    pub scatter: f32,
    /// Angular speed of a piece of area 0.01, radians a second, 0..=100; smaller pieces turn faster. Default: 4.
    pub spin: f32,
    /// Whether pieces turn about any axis; else about the axis through the picture. Default: `true`.
    pub tumble: bool,
    /// Acceleration, x right, y up; each component -100..=100. Default: 2.2 down. Here it is in the surface's own
    /// axes. The plugin turns it so that y is up in the world, unless its `GravitySpace` says otherwise.
    pub gravity: Vec2,
    /// Share of the speed that is lost to air in a second, 0..=100. Default: 0.4.
    pub drag: f32,
    /// Time after its release at which a piece starts to fade, 0..=600. Default: 1.6.
    pub fade_after: f32,
    /// Duration of the fading, 0..=600. Default: 0.6.
    pub fade: f32,
}

impl BurstParams {
    /// The default: glass in a cartoon.
    pub const DEFAULT: Self = Self {
        hold: 0.15,
        front: 8.0,
        speed: 0.9,
        falloff: 0.5,
        along: 0.5,
        scatter: 0.35,
        spin: 4.0,
        tumble: true,
        gravity: Vec2::new(0.0, -2.2),
        drag: 0.4,
        fade_after: 1.6,
        fade: 0.6,
    };

    fn validate(&self) -> Result<(), ShatterError> {
        in_range("hold", self.hold, 0.0, 60.0)?;
        in_range("front", self.front, 0.01, 1000.0)?;
        in_range("speed", self.speed, 0.0, 100.0)?;
        in_range("falloff", self.falloff, 0.001, 64.0)?;
        in_range("along", self.along, 0.0, 1.0)?;
        in_range("scatter", self.scatter, 0.0, 1.0)?;
        in_range("spin", self.spin, 0.0, 100.0)?;
        in_range("gravity", self.gravity.x, -100.0, 100.0)?;
        in_range("gravity", self.gravity.y, -100.0, 100.0)?;
        in_range("drag", self.drag, 0.0, 100.0)?;
        in_range("fade_after", self.fade_after, 0.0, 600.0)?;
        in_range("fade", self.fade, 0.0, 600.0)
    }
}

impl Default for BurstParams {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// A burst of pieces from one hit.
///
/// ```
/// use bevy_crack::shatter::{Burst, BurstParams, Cuts, Pose, ShatterParams, shatter};
/// use glam::Vec3;
///
/// let mut cuts = Cuts::new([1.0, 1.0].into())?;
/// cuts.add_line(&[[0.5, 0.0].into(), [0.5, 1.0].into()])?;
/// let shards = shatter(cuts, &ShatterParams::DEFAULT)?;
/// let burst = Burst::new(BurstParams::DEFAULT, [0.5, 0.5].into(), Vec3::NEG_Z, 1.0, 7)?;
/// for (number, shard) in (0u32..).zip(shards.iter()) {
///     let flight = burst.flight(number, shard);
///     // The left half flies to the left, the right one to the right; backwards, each comes back to its place.
///     assert_eq!(flight.pose(1.0).offset.x < 0.0, shard.centroid.x < 0.5);
///     assert_eq!(flight.pose(0.0), Pose::AT_REST);
/// }
/// # Ok::<(), bevy_crack::shatter::ShatterError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Burst {
    params: BurstParams,
    gravity: Vec3,
    floor: Option<Floor>,
    /// y up, z towards the viewer.
    from: Vec3,
    direction: Vec3,
    energy: f32,
    seed: u64,
}

/// The flight of one piece.
///
/// ```
/// use bevy_crack::shatter::{Burst, BurstParams, Cuts, Flight, ShatterParams, shatter};
/// use glam::Vec3;
///
/// let pane = shatter(Cuts::new([1.0, 1.0].into())?, &ShatterParams::DEFAULT)?;
/// let whole = pane.get(0).expect("one shard");
/// // A surface that hangs sideways in the world: its pieces fall to its right.
/// let burst = Burst::new(BurstParams::DEFAULT, [0.5, 0.5].into(), Vec3::Z, 1.0, 7)?.with_gravity(2.0 * Vec3::X);
/// let falling: Flight = burst.fall(0, whole);
/// assert!(falling.pose(1.0).offset.x > 0.1);
/// // What bursts from a place behind it flies towards the viewer.
/// let behind = burst.with_origin(Vec3::new(0.5, -0.5, -1.0)).flight(0, whole);
/// assert!(behind.velocity.z > 0.0);
/// // A second after the hit it breaks. Its parts go on from where it is then, and fade when it would have.
/// let parts = pane.break_again(0, 0.25, 7)?;
/// let part = behind.fragment(1.0, whole, parts.get(0).expect("parts"), 0.2, 1);
/// assert_eq!(part.delay, 1.0);
/// assert!(part.pose(1.5).offset.x > part.pose(1.0).offset.x);
/// assert!((part.end() - behind.end()).abs() < 1e-5);
/// assert_eq!(behind.pose(behind.end() + 0.01).opacity, 0.0);
/// # Ok::<(), bevy_crack::shatter::ShatterError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flight {
    /// Seconds until it leaves its place.
    pub delay: f32,
    /// Velocity when it leaves, pattern units a second; x right, y up, z towards the viewer. It can also be given to
    /// a physics engine.
    pub velocity: Vec3,
    /// Axis of its rotation, a unit vector.
    pub axis: Vec3,
    /// Angular speed about [`axis`](Self::axis), radians a second.
    pub spin: f32,
    gravity: Vec3,
    drag: f32,
    fade_after: f32,
    fade: f32,
    /// Where it starts: a fragment that broke off in the air does not start in its place in the surface.
    offset: Vec3,
    rotation: Quat,
    /// The floor, and where the piece lands on it.
    floor: Option<Floor>,
    landing: Option<Landing>,
}

/// Position, rotation and opacity of a piece.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Offset from its place in the surface, pattern units; x right, y up, z towards the viewer.
    pub offset: Vec3,
    /// Rotation about its centroid.
    pub rotation: Quat,
    /// Opacity: 1 = fully visible, 0 = faded; the piece can be removed then.
    pub opacity: f32,
}

/// The motion of a piece.
#[derive(Clone, Copy)]
struct Moving {
    offset: Vec3,
    velocity: Vec3,
    rotation: Quat,
    /// Radians a second.
    spin: f32,
}

impl Pose {
    /// The pose in the surface.
    pub const AT_REST: Self = Self { offset: Vec3::ZERO, rotation: Quat::IDENTITY, opacity: 1.0 };
}

/// Area of a piece that flies and turns as the parameters say.
const USUAL_AREA: f32 = 0.01;

impl Burst {
    /// A burst from `from` (pattern units, y down) after a hit in `direction` (y up, z towards the viewer; of any
    /// length, zero = head on).
    ///
    /// # Errors
    /// [`ShatterError::OutOfRange`] if a parameter is out of its range or the energy is outside 0..=1000,
    /// [`ShatterError::NotFinite`] if a coordinate is not finite.
    pub fn new(params: BurstParams, from: Vec2, direction: Vec3, energy: f32, seed: u64) -> Result<Self, ShatterError> {
        params.validate()?;
        in_range("energy", energy, 0.0, 1000.0)?;
        if !from.is_finite() || !direction.is_finite() {
            return Err(ShatterError::NotFinite { index: 0 });
        }
        let direction = direction.try_normalize().unwrap_or(Vec3::NEG_Z);
        let from = Vec3::new(from.x, -from.y, 0.0);
        Ok(Self { gravity: params.gravity.extend(0.0), floor: None, params, from, direction, energy, seed })
    }

    /// The same burst with another acceleration (pattern units a second squared; x right, y up, z towards the
    /// viewer). The pieces of a surface that is rotated in the world do not fall along its own y axis. A value that
    /// is not finite counts as zero.
    #[must_use]
    pub fn with_gravity(mut self, gravity: Vec3) -> Self {
        self.gravity = if gravity.is_finite() { gravity } else { Vec3::ZERO };
        self
    }

    /// The same burst from a point that need not lie in the picture (pattern units from its top left; x right, y up, z towards the viewer): a
    /// piece of a body that is not flat lies in a plane of its own. One that is not finite changes nothing.
    #[must_use]
    pub fn with_origin(mut self, origin: Vec3) -> Self {
        self.from = if origin.is_finite() { origin } else { self.from };
        self
    }

    /// The same burst with a floor on which pieces come to rest.
    ///
    /// ```
    /// use bevy_crack::shatter::{Burst, BurstParams, Cuts, Floor, ShatterParams, shatter};
    /// use glam::Vec3;
    ///
    /// let shards = shatter(Cuts::new([1.0, 1.0].into())?, &ShatterParams::DEFAULT)?;
    /// // Half a pattern unit below the lower edge of the picture.
    /// let floor = Floor { up: Vec3::Y, height: -1.5, clearance: 0.0, depth: 0.0, lies_flat: true };
    /// let burst = Burst::new(BurstParams::DEFAULT, [0.5, 0.5].into(), Vec3::ZERO, 1.0, 7)?.with_floor(floor)?;
    /// let whole = shards.get(0).expect("one piece");
    /// // The middle of the pane comes down by a whole unit, and stays there.
    /// assert!((burst.flight(0, whole).pose(10.0).offset.y + 1.0).abs() < 1e-4);
    /// # Ok::<(), bevy_crack::shatter::ShatterError>(())
    /// ```
    ///
    /// # Errors
    /// [`ShatterError::NotFinite`] if the floor's normal is zero or not finite, [`ShatterError::OutOfRange`] if
    /// another number of it is out of its range.
    pub fn with_floor(mut self, floor: Floor) -> Result<Self, ShatterError> {
        floor.validate()?;
        self.floor = Some(floor);
        Ok(self)
    }

    /// The flight of a piece that the burst knocks out; `number` distinguishes the random draws of pieces.
    #[must_use]
    pub fn flight(&self, number: u32, shard: &ShardShape) -> Flight {
        let BurstParams { speed, falloff, along, scatter, .. } = self.params;
        let away = middle(shard) - self.from;
        let distance = away.length();
        let mut rng = Rng::new(self.seed).stream("burst").substream(u64::from(number));
        let mut noise = || Vec3::new(rng.signed(), rng.signed(), rng.signed());
        // Away from the hit; a piece right at the hit moves only along its direction.
        let out = away / (distance * distance + 0.1 * falloff * falloff).sqrt();
        let direction = out * (1.0 - along) + self.direction * along + noise() * (0.5 * scatter);
        let unevenness = 1.0 + scatter * rng.signed();
        let strength = falloff * falloff / (falloff * falloff + distance * distance);
        let velocity = direction * (speed * self.energy.sqrt() * strength * unevenness * lightness(shard.area));
        self.released(shard, velocity, distance, rng)
    }

    /// The flight of a piece that only falls.
    #[must_use]
    pub fn fall(&self, number: u32, shard: &ShardShape) -> Flight {
        let mut rng = Rng::new(self.seed).stream("fall").substream(u64::from(number));
        let velocity = Vec3::new(rng.signed(), 0.0, rng.signed()) * (0.04 * self.params.scatter);
        let mut flight = self.released(shard, velocity, middle(shard).distance(self.from), rng);
        flight.spin *= 0.25;
        flight
    }

    fn released(&self, shard: &ShardShape, velocity: Vec3, distance: f32, mut rng: Rng) -> Flight {
        let BurstParams { hold, front, spin, tumble, drag, fade_after, fade, .. } = self.params;
        let any = Vec3::new(rng.signed(), rng.signed(), 0.5 * rng.signed());
        let turn = rng.signed();
        let (axis, spin) =
            if tumble { (any.normalize_or(Vec3::X), spin * (0.4 + 0.6 * turn.abs())) } else { (Vec3::Z, spin * turn) };
        let mut flight = Flight {
            delay: hold + distance / front,
            velocity,
            axis,
            spin: spin * lightness(shard.area),
            gravity: self.gravity,
            drag,
            fade_after: fade_after * (0.8 + 0.4 * rng.unit()),
            fade,
            offset: Vec3::ZERO,
            rotation: Quat::IDENTITY,
            floor: self.floor,
            landing: None,
        };
        flight.land(shard, false);
        flight
    }
}

/// The middle of a piece in its place, y up.
fn middle(shard: &ShardShape) -> Vec3 {
    Vec3::new(shard.centroid.x, -shard.centroid.y, 0.0)
}

/// How much faster a piece moves than one of the usual area: the fourth root of the ratio, within 0.5..=2.
fn lightness(area: f32) -> f32 {
    (USUAL_AREA / area.max(1e-9)).sqrt().sqrt().clamp(0.5, 2.0)
}

impl Flight {
    /// The pose `seconds` after the hit. It depends only on the time.
    #[must_use]
    pub fn pose(&self, seconds: f32) -> Pose {
        let time = seconds - self.delay;
        if time.is_nan() || time <= 0.0 {
            return Pose { offset: self.offset, rotation: self.rotation, opacity: 1.0 };
        }
        let faded = if self.fade > 0.0 {
            ((time - self.fade_after) / self.fade).clamp(0.0, 1.0)
        } else {
            f32::from(u8::from(time > self.fade_after))
        };
        let Moving { offset, rotation, .. } = self.moving(time);
        Pose { offset, rotation, opacity: 1.0 - faded }
    }

    /// Computes where the piece comes to rest if there is a floor. `must` is set for parts of a piece that lands.
    fn land(&mut self, shard: &ShardShape, must: bool) {
        self.land_from(middle(shard) + self.offset, shard.area.max(0.0).sqrt(), must);
    }

    /// The same for a piece of this size that starts at `start`.
    fn land_from(&mut self, start: Vec3, size: f32, must: bool) {
        self.landing = self.floor.and_then(|floor| {
            floor.landing(start, (size, must), self.gravity, |time| {
                let Moving { offset, velocity, .. } = self.in_air(time);
                (offset - self.offset, velocity)
            })
        });
    }

    /// The motion of the piece, seconds after its release.
    fn moving(&self, time: f32) -> Moving {
        let Some(landing) = self.landing.filter(|landing| time > landing.time) else { return self.in_air(time) };
        let (since, landed) = (time - landing.time, self.in_air(landing.time));
        let (offset, velocity) = landing.motion(since);
        let rotation = landing.rotation(landed.rotation, since);
        let lift = landing.lift(landed.rotation, since);
        Moving { offset: self.offset + offset + lift, velocity, rotation, spin: 0.0 }
    }

    fn in_air(&self, time: f32) -> Moving {
        let (run, fallen) = self.runs(time);
        let decay = ops::exp(-self.drag * time);
        let half_turn = 0.5 * self.spin * run;
        let rotation = (self.axis * ops::sin(half_turn)).extend(ops::cos(half_turn));
        Moving {
            offset: self.offset + self.velocity * run + self.gravity * fallen,
            velocity: self.velocity * decay + self.gravity * run,
            rotation: after(Quat::from_vec4(rotation), self.rotation),
            spin: self.spin * decay,
        }
    }

    /// The integral of exp(-drag t), and the integral of that; by their series where the formula would lose digits.
    fn runs(&self, time: f32) -> (f32, f32) {
        let x = self.drag * time;
        if x > 0.05 {
            let run = (1.0 - ops::exp(-x)) / self.drag;
            (run, (time - run) / self.drag)
        } else {
            let run = time * (1.0 - x / 2.0 * (1.0 - x / 3.0 * (1.0 - x / 4.0)));
            (run, time * time / 2.0 * (1.0 - x / 3.0 * (1.0 - x / 4.0 * (1.0 - x / 5.0))))
        }
    }

    /// The flight of a fragment that breaks off this piece `seconds` after the hit, in the air. It starts where it is
    /// then, with the velocity of that part of the rotating piece, plus `apart` (pattern units a second) away from
    /// the middle. It fades when the piece would have. `seed` fixes how it tumbles.
    #[must_use]
    pub fn fragment(&self, seconds: f32, piece: &ShardShape, fragment: &ShardShape, apart: f32, seed: u64) -> Self {
        let time = (seconds - self.delay).max(0.0);
        let Moving { offset, velocity, rotation, spin } = self.moving(time);
        let turning = self.axis * spin;
        let way = fragment.centroid - piece.centroid;
        let at_rest = Vec3::new(way.x, -way.y, 0.0);
        let arm = turned(rotation, at_rest);
        let mut rng = Rng::new(seed).stream("fragment");
        let mut noise = || Vec3::new(rng.signed(), rng.signed(), rng.signed());
        let own = turning * 1.3 + noise() * (0.5 * spin);
        let out = (arm.normalize_or_zero() + 0.4 * noise()) * apart;
        let mut flight = Self {
            delay: seconds.max(self.delay),
            velocity: velocity + turning.cross(arm) + out,
            axis: own.normalize_or(self.axis),
            spin: own.length(),
            fade_after: self.fade_after - time,
            offset: offset + arm - at_rest,
            rotation,
            landing: None,
            ..*self
        };
        flight.land(fragment, self.landing.is_some());
        flight
    }

    /// The flight of a crumb that comes off this piece `late` seconds after the piece has left its place. Before, it lies at `at`, `arm` away from
    /// the piece's middle, and it is `size` long; on a floor its middle lies `half` of its height above it; pattern units, y up. It
    /// flies `outward` besides, and fades when the piece does.
    #[cfg(feature = "bevy")]
    #[must_use]
    pub(crate) fn crumb(
        &self,
        (at, arm, [size, half]): (Vec3, Vec3, [f32; 2]),
        outward: Vec3,
        late: f32,
        seed: u64,
    ) -> Self {
        let Moving { offset, velocity, rotation, spin } = self.moving(late);
        let mut rng = Rng::new(seed).stream("crumb");
        let mut noise = || Vec3::new(rng.signed(), rng.signed(), rng.signed());
        let arm_now = turned(rotation, arm);
        let apart = noise() + turned(rotation, outward) + 0.5 * arm_now.normalize_or_zero();
        let velocity = velocity + (self.axis * spin).cross(arm_now);
        let axis = if self.axis == Vec3::Z { Vec3::Z } else { noise().normalize_or(self.axis) };
        let mut flight = Self {
            delay: self.delay + late,
            velocity: velocity * rng.range(0.6, 1.6) + apart * (0.3 + 0.5 * velocity.length()),
            axis,
            spin: self.spin + 12.0 * rng.signed(),
            fade_after: self.fade_after - late,
            offset: offset + arm_now - arm,
            rotation,
            floor: self.floor.map(|floor| Floor { clearance: half, depth: 0.0, ..floor }),
            landing: None,
            ..*self
        };
        flight.land_from(at + flight.offset, size, self.landing.is_some());
        flight
    }

    /// Time at which the piece has faded, seconds after the hit.
    #[must_use]
    pub fn end(&self) -> f32 {
        self.delay + self.fade_after + self.fade
    }
}
