//! What every demo does besides its scene: it is played by hand or by a script, hit and healed.

use crate::{
    film::Film,
    label::Label,
    machine::{DemoArguments, Output},
};
use bevy::{
    ecs::{
        schedule::IntoScheduleConfigs,
        system::{ScheduleSystem, SystemParam},
    },
    image::{ImageAddressMode, ImageLoaderSettings, ImageSampler, ImageSamplerDescriptor},
    prelude::*,
    window::PrimaryWindow,
};
use bevy_crack::prelude::*;
use std::ops::Range;

/// Runs a demo to its end: with the first systems where there is a window, with the second, which play a script, where not.
pub fn play<M, N>(
    mut app: App,
    by_hand: impl IntoScheduleConfigs<ScheduleSystem, M>,
    by_script: impl IntoScheduleConfigs<ScheduleSystem, N>,
) -> AppExit {
    if *app.world().resource::<Output>() == Output::Window {
        app.add_systems(Update, by_hand);
    } else {
        app.add_systems(Update, by_script);
    }
    app.run()
}

/// When things happen in a scripted run, as shares of its length.
#[derive(SystemParam)]
pub struct Script<'w> {
    film: Res<'w, Film>,
    arguments: Res<'w, DemoArguments>,
}

impl Script<'_> {
    /// How much of the run is over after this frame.
    #[must_use]
    pub fn share(&self) -> f32 {
        (self.film.frame() + 1) as f32 / self.arguments.frames.max(1) as f32
    }

    fn share_before(&self) -> f32 {
        self.film.frame() as f32 / self.arguments.frames.max(1) as f32
    }

    /// Whether this is the frame for what happens once, at `share`.
    #[must_use]
    pub fn is_at(&self, share: f32) -> bool {
        (self.share_before()..self.share()).contains(&share)
    }

    /// Which of `count` events, evenly spread over a part of the run, are due in this frame.
    #[must_use]
    pub fn due(&self, count: u32, during: Range<f32>) -> Range<u32> {
        let by = |share: f32| {
            let over = (share - during.start) / (during.end - during.start);
            (over.clamp(0.0, 1.0) * count as f32) as u32
        };
        by(self.share_before())..by(self.share())
    }
}

/// Where the pointer is.
#[derive(SystemParam)]
pub struct Cursor<'w, 's> {
    window: Query<'w, 's, &'static Window, With<PrimaryWindow>>,
    camera: Query<'w, 's, (&'static Camera, &'static GlobalTransform)>,
}

impl Cursor<'_, '_> {
    /// In the world of a 2D scene.
    #[must_use]
    pub fn point(&self) -> Option<Vec2> {
        let (camera, at) = self.camera.single().ok()?;
        camera.viewport_to_world_2d(at, self.window.single().ok()?.cursor_position()?).ok()
    }

    /// From the eye of a 3D scene.
    #[must_use]
    pub fn ray(&self) -> Option<Ray3d> {
        let (camera, at) = self.camera.single().ok()?;
        camera.viewport_to_world(at, self.window.single().ok()?.cursor_position()?).ok()
    }
}

/// Observer of surfaces that crack where they are clicked.
pub fn hit_on_press(press: On<Pointer<Press>>, mut commands: Commands) {
    if let Some(point) = press.hit.position {
        commands.trigger(CrackHit::world(press.entity, point));
    }
}

/// Heals every surface when H is pressed.
pub fn heal_on_h(mut commands: Commands, keys: Res<ButtonInput<KeyCode>>, surfaces: Query<Entity, With<CrackSurface>>) {
    if keys.just_pressed(KeyCode::KeyH) {
        for surface in &surfaces {
            commands.entity(surface).heal_cracks();
        }
    }
}

/// A line of text in a 2D scene, as a hint what to press.
#[must_use]
pub fn caption(text: &str, at: Vec2) -> impl Bundle {
    (Label::grey(text, 18.0, 0.6), Transform::from_translation(at.extend(3.0)))
}

/// A picture that ships with the crate, and its normal map.
#[must_use]
pub fn with_normals(assets: &AssetServer, name: &str) -> (Handle<Image>, Handle<Image>) {
    let normals = assets
        .load_builder()
        .with_settings(|settings: &mut ImageLoaderSettings| settings.is_srgb = false)
        .load(format!("textures/{name}_normal.png"));
    (assets.load(format!("textures/{name}.png")), normals)
}

/// A picture that ships with the crate and repeats.
#[must_use]
pub fn repeated(assets: &AssetServer, name: &str) -> Handle<Image> {
    let settings = |settings: &mut ImageLoaderSettings| {
        settings.sampler = ImageSampler::Descriptor(ImageSamplerDescriptor {
            address_mode_u: ImageAddressMode::Repeat,
            address_mode_v: ImageAddressMode::Repeat,
            ..ImageSamplerDescriptor::linear()
        });
    };
    assets.load_builder().with_settings(settings).load(format!("textures/{name}.png"))
}
