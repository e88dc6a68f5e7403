//! Filter widths on the GPU: what a ray cone makes of pixels, distances, mirrors and scattering, against
//! geometry worked out here; and what widths are for, a distant pattern without noise.

mod case;

use case::{Case, SIZE, Square};
use impasto::Strategy;
use impasto::runtime::audit;
use impasto::runtime::technique::Technique;
use impasto::runtime::world::World;
use impasto::trace::MaterialCode;

fn length(v: [f64; 3]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

fn assert_near(found: [f64; 3], expected: [f64; 3], tolerance: f64) {
    let largest = expected.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    for (f, e) in found.iter().zip(expected) {
        assert!(
            (f - e).abs() <= tolerance * largest,
            "{found:?}, expected {expected:?}"
        );
    }
}

const POSITION: &str = "emission = uniform(color(filter_width(position)));";
const UV: &str = "emission = uniform(color(filter_width(vec3(uv.x, 0.0, uv.y))));";

/// From straight above, and at 60 degrees from there: then twice as long along z.
const VIEWS: [([f64; 3], f64); 2] = [([0.0, 20.0, 0.0], 1.0), ([0.0, 10.0, 17.320_508], 2.0)];

#[test]
fn a_width_is_the_footprint_of_a_pixel() {
    for (from, stretch) in VIEWS {
        for material in [POSITION, UV] {
            let case = Case::floor(material, from);
            let across = case.pixel() * length(from);
            assert_near(case.middle(), [across, 0.0, stretch * across], 0.01);
        }
    }
}

/// Beside the middle, a pixel's cone has the area of the pixel, though not its shape.
#[test]
fn the_area_seen_is_that_of_a_pixel_everywhere() {
    // The product of the diameters, from the sums of their squares along the diagonal of the picture, where x
    // and z are alike.
    let mut case = Case::floor(POSITION, [0.0, 20.0, 0.0]);
    case.fov = 70.0;
    let picture = case.render();
    let area = (case.pixel() * 20.0).powi(2);
    let half = (0.5 * case.fov.to_radians()).tan();
    for i in 0..SIZE {
        let [x, _, z] = picture[(i * SIZE + i) as usize];
        let off = half * (2.0 * (f64::from(i) + 0.5) / f64::from(SIZE) - 1.0);
        let cosine = 1.0 / (1.0 + 2.0 * off * off).sqrt();
        // Of an ellipse of this area, cut from a cone at this angle.
        let squares = area * (cosine + 1.0 / cosine);
        let found = x * x + z * z;
        assert!(
            (found - squares).abs() < 0.02 * squares,
            "pixel {i}: {found}, expected {squares}"
        );
    }
}

#[test]
fn a_larger_scene_is_seen_alike() {
    let (from, _) = VIEWS[1];
    let picture = |material: &str, scale| {
        let case = Case::floor(material, from);
        Case { scale, ..case }.render()
    };
    for power in [-20, 13] {
        let scale = 2f64.powi(power);
        // In units of the scene, so that all pictures are as bright.
        let relative = format!(
            "emission = uniform(color({:?} * filter_width(position)));",
            1.0 / scale
        );
        assert_eq!(picture(&relative, scale), picture(POSITION, 1.0));
        assert_eq!(picture(UV, scale), picture(UV, 1.0));
    }
}

#[test]
fn placed_moved_and_blurred_floors_are_seen_alike() {
    let (from, stretch) = VIEWS[1];
    let placements = "share = true\nplacements = [{ rotate = [0, 90, 0], scale = 0.5 }, { translate = [0, -30, 0] }]";
    for material in [POSITION, UV] {
        let case = Case::floor(material, from);
        let across = case.pixel() * length(from);
        let moved = Case {
            shift: 1e6,
            ..Case::floor(material, from)
        };
        assert_near(moved.middle(), [across, 0.0, stretch * across], 0.01);
        let blurred = Case {
            camera: "aperture = 0.2\nfocus = 20".into(),
            ..Case::floor(material, from)
        };
        assert_near(blurred.middle(), [across, 0.0, stretch * across], 0.02);
        let mut placed = Case::floor(material, from);
        placed.squares[0].placed = placements;
        let expected = match material {
            POSITION => [across, 0.0, stretch * across],
            // Half as large, the coordinates grow twice as fast, and u along z.
            _ => [2.0 * stretch * across, 0.0, 2.0 * across],
        };
        assert_near(placed.middle(), expected, 0.01);
    }
}

#[test]
fn every_organisation_carries_the_same_cones() {
    let own = hall(Strategy::OWN).render();
    for strategy in [Strategy::MIXED, Strategy::INLINE, Strategy::MEGA] {
        for (found, expected) in hall(strategy).render().into_iter().zip(&own) {
            assert_near(found, *expected, 1e-5);
        }
    }
}

/// A floor that scatters, under a mirror.
fn hall(strategy: Strategy) -> Case {
    let mut case = Case::floor(
        format!("surface = diffuse(color(0.5)); {POSITION}"),
        [0.0, 3.0, 4.0],
    );
    case.squares.push(Square {
        y: 5.0,
        ..Square::new("mirror")
    });
    let mirror = "surface = specular(color(0.9)); ".into();
    case.materials.push(("mirror", mirror));
    Case {
        depth: 5,
        strategy,
        ..case
    }
}

#[test]
fn replays_carry_the_same_cones() {
    let case = Case {
        samples: 1,
        ..hall(Strategy::OWN)
    };
    let rendered = case.render();
    for materials in [MaterialCode::Ir, MaterialCode::Wgsl] {
        for (found, expected) in case.replay::<f32>(materials).into_iter().zip(&rendered) {
            assert_near(found, *expected, 1e-4);
        }
    }
    // In double precision a path may part; the picture stays.
    let sum = |picture: &[[f64; 3]]| picture.iter().map(|p| p[0]).sum::<f64>();
    let (double, single) = (sum(&case.replay::<f64>(MaterialCode::Ir)), sum(&rendered));
    assert!(
        (double - single).abs() < 0.02 * single,
        "{double} against {single}"
    );
}

/// A mirror keeps the cone: what it shows is as far as the way there and back.
#[test]
fn a_mirror_shows_widths_of_the_whole_way() {
    let mut case = Case::floor(POSITION, [0.0, 2.0, 0.0]);
    case.squares.push(Square {
        y: 5.0,
        ..Square::new("mirror")
    });
    case.materials
        .push(("mirror", "surface = specular(color(1.0));".into()));
    (case.to, case.depth) = ([0.0, 5.0, 0.0], 2);
    let across = case.pixel() * 8.0;
    assert_near(case.middle(), [across, 0.0, across], 0.02);
}

/// A boundary inside of a medium of higher priority is none: the way to it counts like any other.
#[test]
fn hidden_boundaries_leave_widths_of_the_whole_way() {
    let mut case = Case::floor(POSITION, [0.0, 8.0, 0.0]);
    let clear = |priority: i32| {
        format!(
            "surface = smooth_dielectric(ior: 1.0); interior = medium(ior: 1.0, priority: {priority});"
        )
    };
    // All are entered from above, one in the other.
    for (material, y, priority) in [("around", 6.0, 3), ("hidden", 4.0, 2), ("deep", 1.0, 1)] {
        case.squares.push(Square {
            y,
            turned: true,
            ..Square::new(material)
        });
        case.materials.push((material, clear(priority)));
    }
    case.depth = 2;
    let across = case.pixel() * 8.0;
    assert_near(case.middle(), [across, 0.0, across], 0.01);
}

/// A diffuse ceiling shows the floor through the cones of rays of its density, cos / pi: integrated here.
#[test]
fn scattered_rays_stand_for_the_solid_angle_of_their_density() {
    let seen = "emission = uniform(color(1.0 / (1.0 + length(filter_width(position)))));";
    let mut case = Case::floor(seen, [0.0, 2.0, 0.0]);
    case.squares[0].half = 3000.0;
    case.squares.push(Square {
        y: 5.0,
        ..Square::new("ceiling")
    });
    case.materials
        .push(("ceiling", "surface = diffuse(color(1.0));".into()));
    (case.to, case.depth, case.samples) = ([0.0, 5.0, 0.0], 2, 256);
    let (start, angle) = (case.pixel() * 3.0, case.pixel());
    let steps = 20_000;
    let seen = |i: i32| {
        // The cosine of a diffuse ray is the root of a uniform number.
        let cosine = ((f64::from(i) + 0.5) / f64::from(steps)).sqrt();
        let density = cosine / std::f64::consts::PI;
        let spread = (angle * angle + 1.0 / (16.0 * density)).sqrt().min(1.0);
        let width = start + spread * 5.0 / cosine;
        let stretched = width / cosine.max(1.0 / 16.0);
        1.0 / (1.0 + width.hypot(stretched))
    };
    let expected = (0..steps).map(seen).sum::<f64>() / f64::from(steps);
    let pixels = case.render();
    let found = pixels.iter().map(|p| p[0]).sum::<f64>() / pixels.len() as f64;
    assert!(
        (found - expected).abs() < 0.01 * expected,
        "{found}, expected {expected}"
    );
}

/// Under a metre of fog, the floor is narrow for light that was not turned, and wide for the rest.
#[test]
fn light_that_was_turned_in_a_medium_sees_widely() {
    let narrow = "emission = uniform(color(1.0 - step(0.05, filter_width(position).x)));";
    let mut case = Case::floor(narrow, [0.0, 2.0, 0.0]);
    // The end of the sheet is out of reach; its front is above.
    case.squares.push(Square {
        y: 1.0,
        half: 40.0,
        turned: true,
        ..Square::new("fog")
    });
    let fog = "surface = smooth_dielectric(ior: 1.0); interior = medium(scattering: color(1.0));";
    case.materials.push(("fog", fog.into()));
    (case.depth, case.samples) = (2, 64);
    let pixels = case.render();
    let found = pixels.iter().map(|p| p[0]).sum::<f64>() / pixels.len() as f64;
    // Some of what was turned was so just above the floor.
    let straight = (-1.0f64).exp();
    assert!(
        (straight - 0.02..straight + 0.05).contains(&found),
        "{found}, of {straight}"
    );
}

/// A checkerboard of squares of one metre, averaged over a width; see docs/filtering.md.
fn checker(width: &str) -> String {
    format!(
        "fn tooth(x: vec2) -> vec2 = abs(2.0 * fract(0.5 * x) - 1.0);
        fn board(p: vec2, width: vec2) -> float {{
            let w = max(width, 1e-4);
            let mean = (tooth(p - 0.5 * w) - tooth(p + 0.5 * w)) / w;
            0.5 - 0.5 * mean.x * mean.y
        }}
        %% let p = vec2(position.x, position.z) / 1.0;
        emission = uniform(color(board(p, {width})));"
    )
}

#[test]
fn a_distant_checkerboard_is_grey_without_noise() {
    let view = |width: &str, samples, seed| {
        let mut case = Case::floor(checker(width), [0.3, 3.0, 60.0]);
        case.squares[0].half = 500.0;
        (case.size, case.fov, case.samples, case.seed) = ([24, 8], 8.0, samples, seed);
        case.to = [0.0, 0.0, 30.0];
        let picture = case.render();
        picture.into_iter().map(|p| p[0]).collect::<Vec<f64>>()
    };
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    let difference = |a: &[f64], b: &[f64]| {
        let squares = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b));
        squares.sum::<f64>() / a.len() as f64
    };
    let noise = |width: &str| difference(&view(width, 2, 1), &view(width, 2, 2));
    let (pointwise, filtered) = (noise("vec2(0.0)"), noise("filter_width(p)"));
    assert!(pointwise > 1e-2, "{pointwise}");
    assert!(filtered < 0.2 * pointwise, "{filtered} against {pointwise}");
    let (reference, quick) = (view("vec2(0.0)", 1024, 3), view("filter_width(p)", 16, 4));
    let (expected, found) = (mean(&reference), mean(&quick));
    assert!(
        (found - expected).abs() < 0.01,
        "{found}, expected {expected}"
    );
}

/// The scenes by which the cost of cones is measured differ in them alone.
#[test]
fn a_width_that_a_parameter_takes_away_costs_nothing() {
    let rows = |file: &str| {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/filtering/plaza");
        let scene = impasto::load(&folder.join(file)).unwrap_or_else(|e| panic!("{e}"));
        let program = impasto::compile(&scene).unwrap_or_else(|e| panic!("{e}"));
        let technique = Technique::default();
        let world = World::of_program(&scene, &program, &technique);
        let world = world.unwrap_or_else(|e| panic!("{e}"));
        let report = audit::report(&world, &program, technique).unwrap_or_else(|e| panic!("{e}"));
        let needed = report.rows.into_iter().filter(|row| row.because.is_some());
        let names: Vec<&str> = needed.map(|row| row.name).collect();
        (names, report.extent.path_bytes)
    };
    let (sampled, bytes) = rows("sampled.toml");
    let (mut filtered, more_bytes) = rows("filtered.toml");
    assert_eq!(more_bytes - bytes, 16);
    filtered.retain(|name| *name != "ray cones");
    assert_eq!(filtered, sampled);
}
