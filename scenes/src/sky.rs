//! Environment maps: the city's sky without its sun, and a photographer's studio.

use glam::{DVec3, dvec3};

use crate::image_file::environment;
use crate::random::fractal_noise;

/// Width of the maps in pixels.
const WIDTH: usize = 1024;
/// Where the city's sun stands; `examples/city/scene.toml` names the same direction.
pub(crate) const SUN: DVec3 = dvec3(0.56, 0.60, 0.57);
/// Haze of the Preetham model: 2 is arctic, 6 is hazy.
const TURBIDITY: f64 = 3.2;
/// Radiance that the model's kcd/m^2 are divided by, to suit a sun of irradiance about 10.
const LUMINANCE_SCALE: f64 = 0.11;
/// What the ground far away looks like.
const GROUND: DVec3 = dvec3(0.21, 0.20, 0.19);

/// The sky over the city: clear air after Preetham et al. 1999, "A Practical Analytic Model for
/// Daylight", with thin clouds. The sun's disk is left to a distant light.
pub(crate) fn sky() -> Result<Vec<u8>, String> {
    let sky = ClearSky::new(SUN.normalize(), TURBIDITY);
    environment(WIDTH, |direction| {
        let raised = dvec3(direction.x, direction.y.max(0.01), direction.z).normalize();
        let air = sky.radiance(raised);
        let above = mix(air, clouds(raised, air, SUN.normalize()));
        let below = smoothstep(0.0, -0.05, direction.y);
        above.lerp(GROUND, below)
    })
}

/// A cloud's color with its opacity.
struct Cloud {
    color: DVec3,
    opacity: f64,
}

fn mix(air: DVec3, cloud: Cloud) -> DVec3 {
    air.lerp(cloud.color, cloud.opacity)
}

/// Clouds on a plane overhead, thinner towards the horizon, brighter towards the sun.
fn clouds(direction: DVec3, air: DVec3, sun: DVec3) -> Cloud {
    let place = dvec3(direction.x, 0.0, direction.z) / (direction.y + 0.08);
    let stretched = place * dvec3(0.8, 1.0, 1.35);
    let density = fractal_noise(stretched + 40.0, 7, 11);
    let lit = fractal_noise(stretched + sun * 0.15 + 40.0, 7, 11);
    let coverage = smoothstep(0.50, 0.72, density);
    let fade = smoothstep(0.015, 0.22, direction.y);
    let shade = (0.8 + 2.2 * (density - lit)).clamp(0.45, 1.2);
    let glow = 1.0 + 0.9 * direction.dot(sun).max(0.0).powi(6);
    let white = dvec3(1.0, 0.97, 0.93) * (1.15 * shade * glow);
    Cloud {
        color: white.lerp(air, 0.12),
        opacity: 0.85 * coverage * fade,
    }
}

/// The coefficients of the Preetham model for one sun and turbidity.
struct ClearSky {
    sun: DVec3,
    sun_angle: f64,
    /// Perez coefficients A to E of luminance, x and y.
    perez: [[f64; 5]; 3],
    /// Luminance, x and y at the zenith.
    zenith: [f64; 3],
}

impl ClearSky {
    fn new(sun: DVec3, turbidity: f64) -> Self {
        let t = turbidity;
        let angle = sun.y.acos();
        let cubic = |c: [f64; 4]| ((c[0] * angle + c[1]) * angle + c[2]) * angle + c[3];
        let chi = (4.0 / 9.0 - t / 120.0) * (std::f64::consts::PI - 2.0 * angle);
        let luminance = (4.0453 * t - 4.9710) * chi.tan() - 0.2155 * t + 2.4192;
        let x = t * t * cubic([0.00166, -0.00375, 0.00209, 0.0])
            + t * cubic([-0.02903, 0.06377, -0.03202, 0.00394])
            + cubic([0.11693, -0.21196, 0.06052, 0.25886]);
        let y = t * t * cubic([0.00275, -0.00610, 0.00317, 0.0])
            + t * cubic([-0.04214, 0.08970, -0.04153, 0.00516])
            + cubic([0.15346, -0.26756, 0.06670, 0.26688]);
        Self {
            sun,
            sun_angle: angle,
            perez: [
                [
                    0.1787 * t - 1.4630,
                    -0.3554 * t + 0.4275,
                    -0.0227 * t + 5.3251,
                    0.1206 * t - 2.5771,
                    -0.0670 * t + 0.3703,
                ],
                [
                    -0.0193 * t - 0.2592,
                    -0.0665 * t + 0.0008,
                    -0.0004 * t + 0.2125,
                    -0.0641 * t - 0.8989,
                    -0.0033 * t + 0.0452,
                ],
                [
                    -0.0167 * t - 0.2608,
                    -0.0950 * t + 0.0092,
                    -0.0079 * t + 0.2102,
                    -0.0441 * t - 1.6537,
                    -0.0109 * t + 0.0529,
                ],
            ],
            zenith: [luminance, x, y],
        }
    }

    /// Linear RGB of the air in a direction above the horizon.
    fn radiance(&self, direction: DVec3) -> DVec3 {
        let gamma = direction.dot(self.sun).clamp(-1.0, 1.0).acos();
        let at = |channel: usize| {
            let c = &self.perez[channel];
            let here = perez(c, direction.y, gamma);
            self.zenith[channel] * here / perez(c, 1.0, self.sun_angle)
        };
        let (luminance, x, y) = (at(0) * LUMINANCE_SCALE, at(1), at(2));
        let xyz = dvec3(x / y, 1.0, (1.0 - x - y) / y) * luminance;
        // Rec. 709 primaries, white D65.
        let rgb = dvec3(
            dvec3(3.2406, -1.5372, -0.4986).dot(xyz),
            dvec3(-0.9689, 1.8758, 0.0415).dot(xyz),
            dvec3(0.0557, -0.2040, 1.0570).dot(xyz),
        );
        rgb.max(DVec3::ZERO)
    }
}

/// Relative luminance of a direction `gamma` radians from the sun. Source: Perez et al. 1993.
fn perez(c: &[f64; 5], cos_zenith: f64, gamma: f64) -> f64 {
    let gradient = 1.0 + c[0] * (c[1] / cos_zenith).exp();
    let halo = 1.0 + c[2] * (c[3] * gamma).exp() + c[4] * gamma.cos().powi(2);
    gradient * halo
}

/// A lamp of the studio: a rectangle of light seen around `center`.
struct Softbox {
    center: DVec3,
    /// Half of its width and height, as tangents.
    half: [f64; 2],
    /// Turn about its center in degrees.
    roll: f64,
    /// Share of its size over which its edge fades.
    feather: f64,
    radiance: DVec3,
}

/// Lamps that car photographers use: a long box overhead, strips at the sides, and small hard
/// lights that make flakes sparkle.
const SOFTBOXES: [Softbox; 6] = [
    Softbox {
        center: dvec3(-0.15, 1.0, -0.10),
        half: [0.95, 0.38],
        roll: 12.0,
        feather: 0.25,
        radiance: dvec3(5.2, 5.3, 5.5),
    },
    Softbox {
        center: dvec3(-1.0, 0.42, 0.25),
        half: [0.14, 0.62],
        roll: 0.0,
        feather: 0.3,
        radiance: dvec3(8.0, 8.6, 9.6),
    },
    Softbox {
        center: dvec3(1.0, 0.35, -0.35),
        half: [0.55, 0.30],
        roll: 0.0,
        feather: 0.4,
        radiance: dvec3(3.4, 3.1, 2.7),
    },
    Softbox {
        center: dvec3(0.45, 0.55, 1.0),
        half: [0.07, 0.07],
        roll: 45.0,
        feather: 0.2,
        radiance: dvec3(260.0, 245.0, 220.0),
    },
    Softbox {
        center: dvec3(-0.75, 0.95, 0.60),
        half: [0.05, 0.05],
        roll: 0.0,
        feather: 0.2,
        radiance: dvec3(320.0, 330.0, 350.0),
    },
    Softbox {
        center: dvec3(0.20, 0.16, -1.0),
        half: [1.2, 0.05],
        roll: 0.0,
        feather: 0.6,
        radiance: dvec3(2.2, 2.4, 2.8),
    },
];

/// A dark studio with soft and hard lamps.
pub(crate) fn studio() -> Result<Vec<u8>, String> {
    environment(WIDTH, |direction| {
        let lamps = SOFTBOXES
            .iter()
            .map(|lamp| lamp.radiance * lamp.weight(direction));
        backdrop(direction) + lamps.sum::<DVec3>()
    })
}

/// A seamless paper sweep: darkest overhead, a soft pool of light on the floor.
fn backdrop(direction: DVec3) -> DVec3 {
    let wall = dvec3(0.075, 0.085, 0.105);
    let ceiling = dvec3(0.010, 0.011, 0.014);
    let floor = dvec3(0.13, 0.125, 0.12);
    let up = smoothstep(-0.05, 0.75, direction.y);
    let down = smoothstep(0.10, -0.65, direction.y);
    wall.lerp(ceiling, up).lerp(floor, down)
}

impl Softbox {
    /// How much of the lamp's radiance is seen in `direction`.
    fn weight(&self, direction: DVec3) -> f64 {
        let z = self.center.normalize();
        let side = if z.y.abs() > 0.9 { DVec3::Z } else { DVec3::Y };
        let x = side.cross(z).normalize();
        let y = z.cross(x);
        let distance = direction.dot(z);
        if distance <= 0.0 {
            return 0.0;
        }
        let (sin, cos) = self.roll.to_radians().sin_cos();
        let (a, b) = (direction.dot(x) / distance, direction.dot(y) / distance);
        let inside = |t: f64, half: f64| smoothstep(1.0, 1.0 - self.feather, t.abs() / half);
        inside(a * cos + b * sin, self.half[0]) * inside(b * cos - a * sin, self.half[1])
    }
}

/// 0 at `low`, 1 at `high`, smooth between; `low` may be the greater.
fn smoothstep(low: f64, high: f64, x: f64) -> f64 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_clear_sky_is_blue_and_brighter_around_the_sun() {
        let sky = ClearSky::new(SUN.normalize(), TURBIDITY);
        let away = sky.radiance(dvec3(-0.4, 0.8, -0.45).normalize());
        assert!(away.z > 1.3 * away.x, "{away}");
        let near = sky.radiance((SUN.normalize() + dvec3(0.05, 0.0, 0.0)).normalize());
        assert!(near.y > 2.0 * away.y, "{near} against {away}");
    }

    #[test]
    fn lamps_are_seen_in_their_own_direction_only() {
        for lamp in &SOFTBOXES {
            let center = lamp.center.normalize();
            assert_eq!(lamp.weight(center), 1.0);
            assert_eq!(lamp.weight(-center), 0.0);
        }
    }
}
