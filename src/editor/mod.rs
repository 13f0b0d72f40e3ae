//! The workbench: a panel of egui over any running game or scene (feature `editor`).
//!
//! Add [`CrackEditorPlugin`] to an app that draws cracks. A click on a surface hits it and shows its settings: every field of its preset
//! as a slider, with the range and the text of its documentation, the time of its cracks, shattering, guided cracks, strands and reliefs, what is
//! drawn over it, its textures, what it costs, and files to save to. F1 hides the panel; hidden it costs nothing. Clicks and keys on the
//! panel do not reach the game: neither `Pointer` events nor `ButtonInput`.
//!
//! ```no_run
//! use bevy::prelude::*;
//! use bevy_crack::{editor::CrackEditorPlugin, prelude::*};
//!
//! fn setup(mut commands: Commands, assets: Res<AssetServer>) {
//!     commands.spawn(Camera2d);
//!     commands.spawn((Sprite::from_image(assets.load("textures/concrete.png")), CrackSurface::new(CrackPreset::CONCRETE)));
//! }
//!
//! App::new()
//!     .add_plugins((DefaultPlugins, CrackPlugins, CrackEditorPlugin::default()))
//!     .add_systems(Startup, setup)
//!     .run();
//! ```
//!
//! The panel is drawn by the camera with [`PrimaryEguiContext`]. If none has it, that is the one of the primary window that is drawn
//! last and has no viewport of its own.
//!
//! [`Panel::show`] is a function of a `Ui` and plain values, for panels of one's own and for tests.

mod export;
mod form;
mod history;
mod overlay;
mod panel;
mod place;
mod pointer;
mod state;
mod subject;
mod text;
mod world;

pub use bevy_egui::PrimaryEguiContext;
pub use panel::{Overlays, Panel};
pub use state::CrackEditor;
pub use subject::{AnalogyChoice, Costs, EditorCommand, Export, Subject};

use bevy::{picking::mesh_picking::MeshPickingPlugin, prelude::*};
use bevy_egui::{EguiGlobalSettings, EguiPlugin, EguiPreUpdateSet, EguiPrimaryContextPass, EguiStartupSet};

/// The workbench. Add it after `DefaultPlugins`, [`CrackPlugins`](crate::plugin::CrackPlugins) and, if you add them yourself, egui's
/// plugin and the engine's `MeshPickingPlugin`: it adds what is missing of the last two. What it shows is in [`CrackEditor`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CrackEditorPlugin {
    /// Whether the panel is there from the start; default true.
    pub is_open: bool,
    /// The key that shows and hides it; default F1.
    pub key: Option<KeyCode>,
}

impl Default for CrackEditorPlugin {
    fn default() -> Self {
        Self { is_open: true, key: Some(KeyCode::F1) }
    }
}

impl Plugin for CrackEditorPlugin {
    fn build(&self, app: &mut App) {
        if !app.is_plugin_added::<EguiPlugin>() {
            app.add_plugins(EguiPlugin::default());
        }
        if !app.is_plugin_added::<MeshPickingPlugin>() {
            app.add_plugins(MeshPickingPlugin);
        }
        if let Some(mut settings) = app.world_mut().get_resource_mut::<EguiGlobalSettings>() {
            settings.enable_absorb_bevy_input_system = true;
            if core::mem::take(&mut settings.auto_create_primary_context) {
                let choose = || place::choose_camera.run_if(place::has_no_camera);
                app.add_systems(PreStartup, choose().before(EguiStartupSet::InitContexts))
                    .add_systems(PreUpdate, choose().before(EguiPreUpdateSet::InitContexts));
            }
        }
        app.insert_resource(CrackEditor { is_open: self.is_open, key: self.key, ..default() })
            .add_observer(pointer::press)
            .add_observer(pointer::release)
            .add_systems(Update, (toggle, pointer::make_pickable.run_if(is_open)))
            .add_systems(PostUpdate, overlay::note_dirty.after(crate::plugin::CrackSystems::Paint).run_if(is_open))
            .add_systems(EguiPrimaryContextPass, world::show_panel.run_if(is_open));
    }
}

fn is_open(editor: Res<CrackEditor>) -> bool {
    editor.is_open
}

fn toggle(mut editor: ResMut<CrackEditor>, keys: Option<Res<ButtonInput<KeyCode>>>) {
    if editor.key.zip(keys).is_some_and(|(key, keys)| keys.just_pressed(key)) {
        editor.is_open = !editor.is_open;
    }
}
