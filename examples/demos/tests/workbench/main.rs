//! The workbench from the outside: its panel without a window, in an app without a renderer, and scenes in files.
#![cfg(test)]
#![cfg(feature = "engine")]

mod panel;
mod scenes;

use bevy::{
    app::PluginsState,
    image::TextureAtlasLayout,
    prelude::*,
    render::{RenderPlugin, settings::WgpuSettings},
    time::TimeUpdateStrategy,
    window::ExitCondition,
    winit::WinitPlugin,
};
use bevy_crack::prelude::*;
use std::time::{Duration, Instant};

/// Where the crate's assets lie.
pub(crate) const ASSETS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets");

/// All that a game has but a window and a renderer; 20 ms a frame.
pub(crate) fn app(add: impl FnOnce(&mut App)) -> App {
    app_in(ASSETS, add)
}

/// The same with another folder of assets.
pub(crate) fn app_in(assets: &str, add: impl FnOnce(&mut App)) -> App {
    let mut app = App::new();
    let plugins = DefaultPlugins
        .set(AssetPlugin { file_path: assets.into(), ..default() })
        .set(RenderPlugin { render_creation: WgpuSettings { backends: None, ..default() }.into(), ..default() })
        .set(WindowPlugin { primary_window: None, exit_condition: ExitCondition::DontExit, ..default() })
        .disable::<bevy::log::LogPlugin>()
        .disable::<WinitPlugin>();
    app.add_plugins((plugins, CrackPlugins))
        .init_asset::<TextureAtlasLayout>()
        .insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_millis(20)))
        .insert_resource(CrackBudget { milliseconds: 1e6, ..default() });
    add(&mut app);
    while app.plugins_state() == PluginsState::Adding {
        bevy::tasks::tick_global_task_pools_on_main_thread();
    }
    app.finish();
    app.cleanup();
    app.update();
    app
}

/// Frames until something holds, for a minute at the most.
pub(crate) fn wait_for(app: &mut App, what: &str, mut holds: impl FnMut(&mut App) -> bool) {
    let start = Instant::now();
    while !holds(app) {
        assert!(start.elapsed() < Duration::from_secs(60), "waited in vain for {what}");
        app.update();
    }
}

pub(crate) fn state(app: &App, entity: Entity) -> CrackState {
    app.world().get::<CrackState>(entity).cloned().unwrap_or_default()
}
