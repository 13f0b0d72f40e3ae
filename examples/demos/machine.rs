//! A window, an off-screen picture, or the CPU alone: what this machine can do, found out before the app starts.

use crate::{
    film::{FilmPlugin, RATE},
    label::draw_labels,
};
use bevy::{
    app::ScheduleRunnerPlugin,
    asset::AssetPlugin,
    picking::mesh_picking::MeshPickingPlugin,
    prelude::*,
    render::{
        RenderPlugin,
        renderer::initialize_renderer,
        settings::{RenderCreation, RenderResources, WgpuSettings},
    },
    time::TimeUpdateStrategy,
    window::ExitCondition,
    winit::WinitPlugin,
};
use bevy_crack::prelude::{CrackBudget, CrackPlugins};
use clap::{Arg, CommandFactory, FromArgMatches, Parser};
use std::{panic, path::PathBuf, time::Duration};

/// What every demo takes on its command line.
#[derive(Parser, Resource, Clone, Debug)]
pub struct DemoArguments {
    /// Open no window, even where there is a display
    #[arg(long)]
    pub headless: bool,
    /// Frames of the scripted run without a window, at 30 a second
    #[arg(long, default_value_t = 1800)]
    pub frames: u32,
    /// Pictures in the GIF of such a run
    #[arg(long, default_value_t = 60)]
    pub pictures: u32,
    /// Width of the GIF
    #[arg(long, default_value_t = 400)]
    pub width: u32,
    /// Height of the drawn pictures, which are 1280 wide
    #[arg(long, default_value_t = 720)]
    pub height: u32,
    /// Folder for the pictures of a run without a window
    #[arg(long, default_value = "out")]
    pub out: PathBuf,
    /// Close the window after so many frames
    #[arg(long)]
    pub exit_after: Option<u32>,
}

impl DemoArguments {
    /// Those that this process was given; `about` is what `--help` says of the demo.
    #[must_use]
    pub fn given(about: &'static str) -> Self {
        let matches = Self::command().about(about).get_matches();
        Self::from_arg_matches(&matches).unwrap_or_else(|error| error.exit())
    }

    /// The same, and a name before them.
    #[must_use]
    pub fn given_with_name(about: &'static str) -> (Self, Option<String>) {
        let name = Arg::new("name").index(1).help("What to show");
        let matches = Self::command().about(about).arg(name).get_matches();
        let arguments = Self::from_arg_matches(&matches).unwrap_or_else(|error| error.exit());
        (arguments, matches.get_one::<String>("name").cloned())
    }
}

/// How the demo is shown.
#[derive(Resource, Clone, Copy, Debug, PartialEq, Eq)]
pub enum Output {
    /// A window on the screen.
    Window,
    /// No display: drawn into images, by a GPU or a software one.
    Offscreen,
    /// No adapter at all: the CPU copies of the textures are all there is.
    CpuOnly,
}

/// An app with cracks and all plugins that this machine can run; [`Output`] tells how it is shown.
///
/// `--frames`, `--out` given together with `--headless`, or no display, mean a scripted run without a window.
#[expect(clippy::print_stdout, reason = "a demo says how it runs")]
pub fn demo_app(title: &str, arguments: &DemoArguments) -> App {
    let renderer = try_renderer();
    let forced = arguments.headless || std::env::args().any(|a| a.starts_with("--frames") || a.starts_with("--out"));
    let output = match &renderer {
        None => Output::CpuOnly,
        Some(_) if !forced && display_available() => Output::Window,
        Some(_) => Output::Offscreen,
    };
    match output {
        Output::Window => println!("Opening a window."),
        Output::Offscreen if forced => println!("Playing {} frames without a window.", arguments.frames),
        Output::Offscreen => println!("No display: playing {} frames off-screen.", arguments.frames),
        Output::CpuOnly => println!("No GPU adapter: playing {} frames on the CPU alone.", arguments.frames),
    }
    let creation = match renderer {
        // With a window the engine chooses the adapter itself: it must be able to present to it.
        Some(_) if output == Output::Window => RenderCreation::default(),
        Some(resources) => RenderCreation::Manual(resources),
        None => WgpuSettings { backends: None, ..default() }.into(),
    };
    // The pictures lie in the crate's own folder, two above this package.
    let assets = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets");
    let mut plugins = DefaultPlugins.set(AssetPlugin { file_path: assets.into(), ..default() }).set(RenderPlugin {
        render_creation: creation,
        synchronous_pipeline_compilation: output != Output::Window,
        ..default()
    });
    let mut app = App::new();
    if output == Output::Window {
        let window = Window { title: title.into(), resolution: (1280, 720).into(), ..default() };
        plugins = plugins.set(WindowPlugin { primary_window: Some(window), ..default() });
    } else {
        plugins = plugins
            .disable::<WinitPlugin>()
            .disable::<bevy::render::pipelined_rendering::PipelinedRenderingPlugin>()
            .set(WindowPlugin { primary_window: None, exit_condition: ExitCondition::DontExit, ..default() })
            .add(ScheduleRunnerPlugin::run_loop(Duration::ZERO));
        // Nothing is put off: each frame is to be right.
        app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_secs(1) / RATE))
            .insert_resource(CrackBudget { milliseconds: 1e6, ..default() });
    }
    app.add_plugins(plugins).insert_resource(output).insert_resource(arguments.clone());
    if output == Output::Window {
        app.add_plugins(MeshPickingPlugin);
    }
    app.add_plugins((CrackPlugins, FilmPlugin)).add_systems(Update, draw_labels);
    app
}

/// Whether a window system answers. Opening a window where none does panics, and can be tried only once a process.
fn display_available() -> bool {
    #[cfg(all(unix, not(target_os = "macos")))]
    {
        let Some(display) = std::env::var("DISPLAY").ok().filter(|display| !display.is_empty()) else { return false };
        let Some((host, number)) = display.split_once(':') else { return false };
        let number = number.split('.').next().unwrap_or("0");
        // A remote display (ssh -X) is taken on trust.
        (!host.is_empty() && host != "unix")
            || std::os::unix::net::UnixStream::connect(format!("/tmp/.X11-unix/X{number}")).is_ok()
    }
    #[cfg(not(all(unix, not(target_os = "macos"))))]
    {
        true
    }
}

/// The renderer, or `None` where there is no adapter (then the engine panics; the message is kept from the user).
fn try_renderer() -> Option<RenderResources> {
    let settings = WgpuSettings::default();
    let backends = settings.backends?;
    let hook = panic::take_hook();
    panic::set_hook(Box::new(|_| {}));
    let found = panic::catch_unwind(|| bevy::tasks::block_on(initialize_renderer(backends, None, &settings)));
    panic::set_hook(hook);
    found.ok()
}
