//! A wall that is hit by HTTP: any program that speaks the engine's remote protocol can crack it.
//!
//! The demo prints the command to send. Without a display (or with `--headless`) it sends hits to itself, and pictures and a GIF are
//! written to `--out`.

use bevy::{
    prelude::*,
    remote::{RemotePlugin, http::RemoteHttpPlugin},
};
use bevy_crack::prelude::*;
use bevy_crack_demos::{DemoArguments, OnCanvas, Script, demo_app, heal_on_h, play};
use std::{
    io::{Read, Write},
    net::TcpStream,
};

/// Where the app listens: on this machine alone.
const PORT: u16 = 15702;

#[derive(Component)]
struct Wall;

fn main() -> AppExit {
    let about = DemoArguments::given("A wall that is hit by HTTP");
    let mut app = demo_app("bevy_crack: remote", &about);
    app.add_plugins((RemotePlugin::default(), RemoteHttpPlugin::default().with_port(PORT))).add_systems(Startup, setup);
    play(app, heal_on_h, send_by_script)
}

#[expect(clippy::print_stdout, reason = "a demo says how to use it")]
fn setup(mut commands: Commands, assets: Res<AssetServer>) {
    commands.spawn(Camera2d);
    let picture = assets.load("textures/concrete_fine.png");
    let size = Vec2::splat(640.0);
    let wall = commands
        .spawn((
            Wall,
            Sprite { image: picture.clone(), custom_size: Some(size), ..default() },
            CrackSurface::new(CrackPreset::CONCRETE),
            OnCanvas { picture, size },
        ))
        .id();
    println!("curl localhost:{PORT} -d '{}'", request(wall, Vec2::splat(0.5)));
}

/// A hit as the remote protocol has it (JSON-RPC 2.0).
fn request(wall: Entity, uv: Vec2) -> String {
    format!(
        r#"{{"jsonrpc":"2.0","id":1,"method":"world.trigger_event","params":{{"event":"{}","value":{{"entity":{},"at":{{"Uv":[{},{}]}},"energy":1.5,"direction":[0,0,-1]}}}}}}"#,
        CrackHit::type_path(),
        wall.to_bits(),
        uv.x,
        uv.y
    )
}

/// The scripted run: three hits, sent as a program beside the game would.
fn send_by_script(script: Script, wall: Single<Entity, With<Wall>>) {
    let places = [Vec2::new(0.3, 0.35), Vec2::new(0.7, 0.4), Vec2::new(0.45, 0.75)];
    for i in script.due(3, 0.1..0.7) {
        let request = request(*wall, places[i as usize % 3]);
        std::thread::spawn(move || send(&request));
    }
}

#[expect(clippy::print_stderr, reason = "a demo says what went wrong")]
fn send(request: &str) {
    let length = request.len();
    let message =
        format!("POST / HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\nContent-Length: {length}\r\n\r\n{request}");
    let sent = TcpStream::connect(("127.0.0.1", PORT)).and_then(|mut stream| {
        stream.write_all(message.as_bytes())?;
        stream.read_to_end(&mut Vec::new())
    });
    if let Err(error) = sent {
        eprintln!("the hit was not sent: {error}");
    }
}
