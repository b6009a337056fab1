// Hemi-octahedral impostors in HLSL, for Unity (impostor.shader includes this file) and Unreal (see unreal.md): the same as
// impostor.js. The two crossed planes of the level stay as they are: of their four rectangles one is turned to the viewer, the
// others vanish. It shows what the three frames of the sheet hold that were drawn from around the viewer's direction, each
// moved to its depth, mixed by their shares.
//
// All is in the space of the glTF file: metres, y upwards, right-handed, texture coordinates from the upper left. What an
// engine's samplers and normal maps want otherwise is told by these two:
#ifndef IMPOSTOR_UV
#define IMPOSTOR_UV(uv) (uv)
#endif
#ifndef IMPOSTOR_NORMAL
#define IMPOSTOR_NORMAL(texel) ((texel).xyz * 2.0 - 1.0)
#endif

struct Impostor
{
    // As the manifest tells.
    float4 sheet;       // upper left and lower right corner in the atlas
    float4 shape;       // frames along an edge; radius, reach and height, metres
    float3 middle;
    // Who looks: from where, or from which direction if that is far away.
    float3 eye;
    float3 back;
    bool isFar;
    // What is seen.
    float4 color;       // premultiplied until it is finished
    float3 normal;
    float occlusion;
    float roughness;

    float3 Towards()
    {
        return normalize(isFar ? back : eye - middle);
    }

    float2 HalfExtent(float3 z)
    {
        return float2(shape.z, shape.w * length(z.xz) + shape.z * abs(z.y));
    }

    // Level, to the right of who looks along -z.
    float3 RightOf(float3 z)
    {
        return abs(z.x) + abs(z.z) > 1e-4 ? normalize(float3(z.z, 0.0, -z.x)) : float3(1.0, 0.0, 0.0);
    }

    // Where a vertex of the crossed planes goes, by its texture coordinates.
    float3 Placed(float2 uv)
    {
        float2 inSheet = (uv - sheet.xy) / (sheet.zw - sheet.xy) * shape.x;
        if (any(floor(inSheet) > 0.0)) return middle;
        float2 corner = float2(inSheet.x > 0.5 ? 1.0 : -1.0, inSheet.y > 0.5 ? -1.0 : 1.0);
        float3 z = Towards();
        // From nearby the near side of the tree is larger.
        float grown = isFar ? 1.0 : 1.0 / max(1.0 - shape.y / length(eye - middle), 0.2);
        float2 at = corner * HalfExtent(z) * grown;
        float3 right = RightOf(z);
        return middle + right * at.x + cross(z, right) * at.y;
    }

    // Adds what a frame holds where the ray meets the tree, by its alpha.
    void AddFrame(float2 frame, float share, float3 rayFrom, float3 rayAlong, float2 halfTexel,
        Texture2D colors, SamplerState colorSampler, Texture2D normals, SamplerState normalSampler,
        Texture2D orms, SamplerState ormSampler)
    {
        float2 place = frame / (shape.x - 1.0) * 2.0 - 1.0;
        float2 level = float2(place.x - place.y, place.x + place.y) * 0.5;
        float3 z = normalize(float3(level.x, max(1.0 - abs(level.x) - abs(level.y), 0.0), level.y));
        float3 x = RightOf(z);
        float3 y = cross(z, x);
        float2 extent = HalfExtent(z);
        float2 edge = (sheet.zw - sheet.xy) / shape.x;
        float3 from = float3(dot(rayFrom, x), dot(rayFrom, y), dot(rayFrom, z));
        float3 along = float3(dot(rayAlong, x), dot(rayAlong, y), dot(rayAlong, z));
        float2 slope = along.xy / min(along.z, -1e-4);
        float2 onPlane = from.xy - slope * from.z;
        float2 scale = float2(0.5, -0.5) / extent;
        // Trunks a texel or two wide are gone in the mips that pixels ask for. Finer ones are taken, which three mixed frames keep
        // calm.
        float finer = 0.35;
        float2 dx = ddx(onPlane) * scale * edge * finer;
        float2 dy = ddy(onPlane) * scale * edge * finer;
        float deep = 0.0;
        for (int i = 0; i < 2; i++)
        {
            float2 on = clamp(0.5 + (onPlane + slope * deep) * scale, halfTexel, 1.0 - halfTexel);
            float2 uv = sheet.xy + (frame + on) * edge;
            deep = (orms.SampleGrad(ormSampler, IMPOSTOR_UV(uv), dx, dy).b * 2.0 - 1.0) * shape.y;
        }
        float2 seen = onPlane + slope * deep;
        float2 within = clamp(0.5 + seen * scale, halfTexel, 1.0 - halfTexel);
        float2 at = IMPOSTOR_UV(sheet.xy + (frame + within) * edge);
        float4 texel = colors.SampleGrad(colorSampler, at, dx, dy);
        float own = any(abs(seen) > extent) ? 0.0 : texel.a * share;
        float4 orm = orms.SampleGrad(ormSampler, at, dx, dy);
        // Above a leaf's roughness it is told how far the normal looks away.
        float away = saturate((orm.g - 0.784) / 0.216);
        float3 turned = normalize(IMPOSTOR_NORMAL(normals.SampleGrad(normalSampler, at, dx, dy))) * sqrt(1.0 - away * away);
        turned.z -= away;
        color += float4(texel.rgb * own, own);
        normal += (x * turned.x + y * turned.y + z * turned.z) * own;
        occlusion += orm.r * own;
        roughness += min(orm.g, 0.784) * own;
    }

    // Looks at a place of the rectangle; `texels` of the atlas.
    void Look(float3 position, float2 texels,
        Texture2D colors, SamplerState colorSampler, Texture2D normals, SamplerState normalSampler,
        Texture2D orms, SamplerState ormSampler)
    {
        float3 z = Towards();
        float3 rayFrom = position - middle;
        float3 rayAlong = isFar ? -z : position - eye;
        float2 halfTexel = 0.5 * shape.x / (texels * (sheet.zw - sheet.xy));

        // The place on the half octahedron; from below it is the horizon's.
        float3 upper = float3(z.x, max(z.y, 0.0), z.z);
        upper /= abs(upper.x) + upper.y + abs(upper.z);
        float2 place = (float2(upper.x + upper.z, upper.z - upper.x) * 0.5 + 0.5) * (shape.x - 1.0);
        float2 first = clamp(floor(place), 0.0, shape.x - 2.0);
        float2 part = place - first;
        float2 second = first + (part.x > part.y ? float2(1.0, 0.0) : float2(0.0, 1.0));
        float3 shares = float3(1.0 - max(part.x, part.y), abs(part.x - part.y), min(part.x, part.y));

        color = 0.0;
        normal = 0.0;
        occlusion = 0.0;
        roughness = 0.0;
        AddFrame(first, shares.x, rayFrom, rayAlong, halfTexel,
            colors, colorSampler, normals, normalSampler, orms, ormSampler);
        AddFrame(second, shares.y, rayFrom, rayAlong, halfTexel,
            colors, colorSampler, normals, normalSampler, orms, ormSampler);
        AddFrame(first + 1.0, shares.z, rayFrom, rayAlong, halfTexel,
            colors, colorSampler, normals, normalSampler, orms, ormSampler);
        float whole = max(color.a, 1e-4);
        color.rgb /= whole;
        occlusion /= whole;
        roughness /= whole;
        normal = color.a > 0.0 ? normalize(normal) : z;
    }
};
