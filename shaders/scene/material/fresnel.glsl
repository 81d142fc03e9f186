// Twin of src/scene/material/fresnel.rs.
#ifndef SCENE_MATERIAL_FRESNEL
#define SCENE_MATERIAL_FRESNEL

float fresnel_dielectric(float cos, float eta, out float refracted) {
    float sin2 = (1.0 - cos) * (1.0 + cos);
    float sin = sqrt(sin2 > 0.0 ? sin2 : 0.0) / eta;
    float refracted2 = (1.0 - sin) * (1.0 + sin);
    refracted = 0.0;
    if (refracted2 <= 0.0) return 1.0;
    refracted = sqrt(refracted2);
    float s = (cos - eta * refracted) / (cos + eta * refracted);
    float p = (eta * cos - refracted) / (eta * cos + refracted);
    return 0.5 * (s * s + p * p);
}

const vec3 TINY = vec3(1.17549435e-38);

vec3 fresnel_conductor(float cos, vec3 eta, vec3 k) {
    float cos2 = cos * cos;
    float sin2 = (1.0 - cos) * (1.0 + cos);
    vec3 real = eta * eta - k * k - vec3(sin2);
    vec3 modulus = sqrt(real * real + eta * eta * k * k * 4.0);
    vec3 a = sqrt(max((modulus + real) * 0.5, vec3(0.0)));
    vec3 sum = modulus + vec3(cos2), across = a * (2.0 * cos);
    vec3 s = (sum - across) / max(sum + across, TINY);
    vec3 all = modulus * cos2 + vec3(sin2 * sin2), along = across * sin2;
    vec3 p = s * ((all - along) / max(all + along, TINY));
    return max((s + p) * 0.5, vec3(0.0));
}
#endif
