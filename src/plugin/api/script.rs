//! [`CrackScript`]: hits at given times.

use bevy::prelude::*;

/// Hits at given times, for scenes in files and for replays: put it beside a [`CrackSurface`](super::CrackSurface).
///
/// The app's [`Time`] counts, from the first frame in which the component is there. A hit comes in the frame in which its time comes, so
/// the cracks in the end are the same at any frame rate, if no hit comes before the cracks of the one before it have come to rest.
///
/// ```
/// use bevy::prelude::*;
/// use bevy_crack::prelude::*;
///
/// fn setup(mut commands: Commands, assets: Res<AssetServer>) {
///     commands.spawn((
///         Sprite::from_image(assets.load("textures/glass_pane.png")),
///         CrackSurface::new(CrackPreset::GLASS),
///         CrackScript {
///             hits: vec![ScriptedHit { at: 0.5, uv: Vec2::new(0.4, 0.5), ..default() }],
///             shatter_at: Some(2.0),
///             repeat_after: Some(5.0),
///             ..default()
///         },
///     ));
/// }
///
/// // Ordinary hits.
/// let drum = CrackScript::new([(0.5, Vec2::new(0.3, 0.5)), (1.0, Vec2::new(0.7, 0.5))]);
/// assert_eq!(drum.hits[1], ScriptedHit { at: 1.0, uv: Vec2::new(0.7, 0.5), energy: 1.0, direction: Vec3::ZERO });
/// ```
#[derive(Component, Reflect, Clone, Debug, Default, PartialEq)]
#[type_path = "bevy_crack"]
#[reflect(Component, Default, Clone, Debug, PartialEq)]
pub struct CrackScript {
    /// The hits, in any order; default none.
    pub hits: Vec<ScriptedHit>,
    /// When all of the surface that nothing holds falls, seconds; `None` (default) = never. See
    /// [`ShatterCracks`](super::ShatterCracks).
    pub shatter_at: Option<f32>,
    /// When the surface is healed and the script begins again, seconds; `None` (default) = never.
    pub repeat_after: Option<f32>,
    /// Seconds that have passed; default 0.
    pub time: f32,
}

/// A hit of a [`CrackScript`].
#[derive(Reflect, Clone, Copy, Debug, PartialEq)]
#[type_path = "bevy_crack"]
#[reflect(Default, Clone, Debug, PartialEq)]
pub struct ScriptedHit {
    /// When it comes, seconds; a time that is not a number or below zero never comes; default 0.
    pub at: f32,
    /// Where, texture coordinates, 0..=1, v down; default the middle.
    pub uv: Vec2,
    /// How hard, see [`CrackHit::energy`](super::CrackHit::energy); default 1.
    pub energy: f32,
    /// Direction of the blow in the world; zero (default) = straight.
    pub direction: Vec3,
}

impl Default for ScriptedHit {
    fn default() -> Self {
        Self { at: 0.0, uv: Vec2::splat(0.5), energy: 1.0, direction: Vec3::ZERO }
    }
}

impl CrackScript {
    /// Hits at these times and places, of energy 1.
    #[must_use]
    pub fn new(hits: impl IntoIterator<Item = (f32, Vec2)>) -> Self {
        let hits = hits.into_iter().map(|(at, uv)| ScriptedHit { at, uv, ..default() }).collect();
        Self { hits, ..default() }
    }

    /// The time of the last thing that happens, seconds.
    pub(crate) fn end(&self) -> f32 {
        let times = self.hits.iter().map(|hit| hit.at).chain(self.shatter_at).chain(self.repeat_after);
        times.filter(|time| time.is_finite()).fold(0.0, f32::max)
    }
}
