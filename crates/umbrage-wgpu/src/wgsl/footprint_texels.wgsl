// Maps were blurred by so many texels; one sample does.
fn shadow_footprint(receiver: ShadowReceiver) -> ShadowFootprint {
    return ShadowFootprint({FIRST_LEVEL}, vec2u(1u), vec2f(0.0), vec2f(0.0), vec3f({VARIANCE}, {VARIANCE}, 0.0));
}
