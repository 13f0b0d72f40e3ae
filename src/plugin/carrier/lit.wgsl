#import bevy_sprite::{
    mesh2d_vertex_output::VertexOutput,
}

// The length of the arrays is MAX_LIGHTS in lit.rs.
struct CrackLit {
    // World position; w = range.
    position: array<vec4<f32>, 4>,
    // Linear colour times intensity.
    color: array<vec4<f32>, 4>,
    ambient: vec4<f32>,
    tint: vec4<f32>,
};
@group(#{MATERIAL_BIND_GROUP}) @binding(0) var<uniform> lit: CrackLit;
@group(#{MATERIAL_BIND_GROUP}) @binding(1) var diffuse_texture: texture_2d<f32>;
@group(#{MATERIAL_BIND_GROUP}) @binding(2) var diffuse_sampler: sampler;
@group(#{MATERIAL_BIND_GROUP}) @binding(3) var normal_texture: texture_2d<f32>;
@group(#{MATERIAL_BIND_GROUP}) @binding(4) var normal_sampler: sampler;

@fragment
fn fragment(in: VertexOutput) -> @location(0) vec4<f32> {
    var albedo = textureSample(diffuse_texture, diffuse_sampler, in.uv) * lit.tint;
#ifdef VERTEX_COLORS
    albedo *= in.color;
#endif
    let texel = textureSample(normal_texture, normal_sampler, in.uv);

    // Where u and v run in the world, from the screen: right for turned, mirrored and skewed quads alike.
    // There is no normal map without uv, so the determinant is zero for edge-on quads only.
    let dx = dpdx(in.world_position.xy);
    let dy = dpdy(in.world_position.xy);
    let du = vec2(dpdx(in.uv.x), dpdy(in.uv.x));
    let dv = vec2(dpdx(in.uv.y), dpdy(in.uv.y));
    let side = select(-1.0, 1.0, du.x * dv.y - du.y * dv.x >= 0.0);
    let along_u = (dx * dv.y - dy * dv.x) * side;
    let along_v = (dy * du.x - dx * du.y) * side;
    let right = along_u / max(length(along_u), 1e-20);
    // v runs down, green is up.
    let up = -along_v / max(length(along_v), 1e-20);

    let local = texel.xyz * 2.0 - 1.0;
    // A white fallback texture stands for no normal map.
    let even = texel.x + texel.y + texel.z > 2.99;
    let bent = vec3(local.x * right + local.y * up, local.z);
    let normal = select(normalize(bent), vec3(0.0, 0.0, 1.0), even);

    var light = lit.ambient.rgb;
    for (var i = 0; i < 4; i++) {
        let range = lit.position[i].w;
        if range > 0.0 {
            let to_light = lit.position[i].xyz - in.world_position.xyz;
            let distance = length(to_light);
            let falloff = saturate(1.0 - distance / range);
            let lambert = max(dot(normal, to_light / max(distance, 1e-6)), 0.0);
            light += lit.color[i].rgb * lambert * falloff * falloff;
        }
    }
    return vec4(albedo.rgb * light, albedo.a);
}
