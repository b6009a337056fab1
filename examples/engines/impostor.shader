// Hemi-octahedral impostors for Unity's Universal Render Pipeline: what impostor.hlsl, which lies beside this file, shows, with
// the pipeline's lights, fog, shadows and cross-fading levels. unity.md has the script that puts it on a level.
Shader "Treewright/Impostor"
{
    Properties
    {
        [NoScaleOffset] _SheetColor ("Colour", 2D) = "white" {}
        [NoScaleOffset] _SheetNormal ("Normals", 2D) = "bump" {}
        [NoScaleOffset] _SheetOrm ("Occlusion, roughness, depth", 2D) = "white" {}
        _SheetTurned ("Scale and offset of the textures", Vector) = (1, 1, 0, 0)
        _Sheet ("Corners in the atlas", Vector) = (0, 0, 1, 1)
        _Shape ("Frames, radius, reach, height", Vector) = (8, 1, 1, 1)
        _Middle ("Middle of the tree", Vector) = (0, 0, 0, 0)
        _Cutoff ("Least alpha", Range(0, 1)) = 0.5
    }

    SubShader
    {
        // Batches of static meshes would not know where a tree stands.
        Tags { "RenderType" = "TransparentCutout" "Queue" = "AlphaTest" "RenderPipeline" = "UniversalPipeline" "DisableBatching" = "True" }
        Cull Off

        HLSLINCLUDE
        #include "Packages/com.unity.render-pipelines.universal/ShaderLibrary/Core.hlsl"
        #include "Packages/com.unity.render-pipelines.universal/ShaderLibrary/Lighting.hlsl"
        #if defined(LOD_FADE_CROSSFADE)
        #include "Packages/com.unity.render-pipelines.universal/ShaderLibrary/LODCrossFade.hlsl"
        #endif

        CBUFFER_START(UnityPerMaterial)
        float4 _SheetColor_TexelSize;
        float4 _SheetTurned;
        float4 _Sheet;
        float4 _Shape;
        float4 _Middle;
        float _Cutoff;
        CBUFFER_END

        TEXTURE2D(_SheetColor); SAMPLER(sampler_SheetColor);
        TEXTURE2D(_SheetNormal); SAMPLER(sampler_SheetNormal);
        TEXTURE2D(_SheetOrm); SAMPLER(sampler_SheetOrm);

        // Importers of glTF turn texture coordinates over, and mirror what is to be left-handed at x.
        #define IMPOSTOR_UV(uv) (float2((uv).x, 1.0 - (uv).y) * _SheetTurned.xy + _SheetTurned.zw)
        #define IMPOSTOR_NORMAL(texel) UnpackNormal(texel)
        #include "impostor.hlsl"

        float3 Mirrored(float3 v)
        {
            return float3(-v.x, v.y, v.z);
        }

        float3 _LightDirection;
        float3 _LightPosition;

        // Who looks: the camera, or the light whose shadows are drawn.
        Impostor Told(bool isLight)
        {
            Impostor it = (Impostor)0;
            it.sheet = _Sheet;
            it.shape = _Shape;
            it.middle = _Middle.xyz;
            float3 from = GetCameraPositionWS(), back = -GetViewForwardDir();
            it.isFar = !IsPerspectiveProjection();
            if (isLight)
            {
                from = _LightPosition;
                back = _LightDirection;
                #if defined(_CASTING_PUNCTUAL_LIGHT_SHADOW)
                it.isFar = false;
                #else
                it.isFar = true;
                #endif
            }
            it.eye = Mirrored(TransformWorldToObject(from));
            it.back = Mirrored(TransformWorldToObjectDir(back, false));
            return it;
        }

        struct Attributes
        {
            float4 positionOS : POSITION;
            float2 uv : TEXCOORD0;
            UNITY_VERTEX_INPUT_INSTANCE_ID
        };

        struct Varyings
        {
            float4 positionCS : SV_POSITION;
            float3 inTree : TEXCOORD0;
            float3 positionWS : TEXCOORD1;
            float fog : TEXCOORD2;
            UNITY_VERTEX_INPUT_INSTANCE_ID
            UNITY_VERTEX_OUTPUT_STEREO
        };

        Varyings Put(Attributes input, bool isLight)
        {
            Varyings output = (Varyings)0;
            UNITY_SETUP_INSTANCE_ID(input);
            UNITY_TRANSFER_INSTANCE_ID(input, output);
            UNITY_INITIALIZE_VERTEX_OUTPUT_STEREO(output);
            Impostor it = Told(isLight);
            output.inTree = it.Placed(float2(input.uv.x, 1.0 - input.uv.y));
            output.positionWS = TransformObjectToWorld(Mirrored(output.inTree));
            output.positionCS = TransformWorldToHClip(output.positionWS);
            output.fog = ComputeFogFactor(output.positionCS.z);
            return output;
        }

        Varyings Placed(Attributes input)
        {
            return Put(input, false);
        }

        Impostor Cut(Varyings input, bool isLight)
        {
            UNITY_SETUP_INSTANCE_ID(input);
            UNITY_SETUP_STEREO_EYE_INDEX_POST_VERTEX(input);
            #if defined(LOD_FADE_CROSSFADE)
            LODFadeCrossFade(input.positionCS);
            #endif
            Impostor seen = Told(isLight);
            seen.Look(input.inTree, _SheetColor_TexelSize.zw, _SheetColor, sampler_SheetColor,
                _SheetNormal, sampler_SheetNormal, _SheetOrm, sampler_SheetOrm);
            clip(seen.color.a - _Cutoff);
            return seen;
        }

        float3 NormalWS(Impostor seen)
        {
            return normalize(TransformObjectToWorldNormal(Mirrored(seen.normal)));
        }
        ENDHLSL

        Pass
        {
            Name "ForwardLit"
            Tags { "LightMode" = "UniversalForward" }

            HLSLPROGRAM
            #pragma target 3.5
            #pragma vertex Placed
            #pragma fragment Lit
            // No shadows are received: the rectangle would stand in its own.
            #pragma multi_compile _ _ADDITIONAL_LIGHTS_VERTEX _ADDITIONAL_LIGHTS
            #pragma multi_compile _ _FORWARD_PLUS
            #pragma multi_compile_fragment _ LOD_FADE_CROSSFADE
            #pragma multi_compile_fog
            #pragma multi_compile_instancing

            half4 Lit(Varyings input) : SV_Target
            {
                Impostor seen = Cut(input, false);
                SurfaceData surface = (SurfaceData)0;
                surface.albedo = seen.color.rgb;
                surface.alpha = 1.0;
                surface.smoothness = 1.0 - seen.roughness;
                surface.occlusion = seen.occlusion;
                surface.normalTS = half3(0.0, 0.0, 1.0);
                InputData data = (InputData)0;
                data.positionWS = input.positionWS;
                data.normalWS = NormalWS(seen);
                data.viewDirectionWS = GetWorldSpaceNormalizeViewDir(input.positionWS);
                data.fogCoord = InitializeInputDataFog(float4(input.positionWS, 1.0), input.fog);
                data.bakedGI = SampleSH(data.normalWS);
                data.normalizedScreenSpaceUV = GetNormalizedScreenSpaceUV(input.positionCS);
                data.shadowMask = half4(1.0, 1.0, 1.0, 1.0);
                half4 color = UniversalFragmentPBR(data, surface);
                return half4(MixFog(color.rgb, data.fogCoord), 1.0);
            }
            ENDHLSL
        }

        Pass
        {
            Name "ShadowCaster"
            Tags { "LightMode" = "ShadowCaster" }
            ColorMask 0

            HLSLPROGRAM
            #pragma target 3.5
            #pragma vertex Thrown
            #pragma fragment Shadow
            #pragma multi_compile_vertex _ _CASTING_PUNCTUAL_LIGHT_SHADOW
            #pragma multi_compile_fragment _ _CASTING_PUNCTUAL_LIGHT_SHADOW
            #pragma multi_compile_fragment _ LOD_FADE_CROSSFADE
            #pragma multi_compile_instancing

            Varyings Thrown(Attributes input)
            {
                Varyings output = Put(input, true);
                #if defined(_CASTING_PUNCTUAL_LIGHT_SHADOW)
                float3 light = normalize(_LightPosition - output.positionWS);
                #else
                float3 light = _LightDirection;
                #endif
                // The rectangle faces the light.
                output.positionCS = TransformWorldToHClip(ApplyShadowBias(output.positionWS, light, light));
                #if UNITY_REVERSED_Z
                output.positionCS.z = min(output.positionCS.z, UNITY_NEAR_CLIP_VALUE);
                #else
                output.positionCS.z = max(output.positionCS.z, UNITY_NEAR_CLIP_VALUE);
                #endif
                return output;
            }

            half4 Shadow(Varyings input) : SV_Target
            {
                Cut(input, true);
                return 0;
            }
            ENDHLSL
        }

        Pass
        {
            Name "DepthOnly"
            Tags { "LightMode" = "DepthOnly" }
            ColorMask R

            HLSLPROGRAM
            #pragma target 3.5
            #pragma vertex Placed
            #pragma fragment Depth
            #pragma multi_compile_fragment _ LOD_FADE_CROSSFADE
            #pragma multi_compile_instancing

            half Depth(Varyings input) : SV_Target
            {
                Cut(input, false);
                return input.positionCS.z;
            }
            ENDHLSL
        }

        Pass
        {
            Name "DepthNormals"
            Tags { "LightMode" = "DepthNormals" }

            HLSLPROGRAM
            #pragma target 3.5
            #pragma vertex Placed
            #pragma fragment Normals
            #pragma multi_compile_fragment _ LOD_FADE_CROSSFADE
            #pragma multi_compile_instancing

            half4 Normals(Varyings input) : SV_Target
            {
                return half4(NormalWS(Cut(input, false)), 0.0);
            }
            ENDHLSL
        }
    }
}
