//! Nothing but benches: `cargo bench -p bevy_crack_peers`.
