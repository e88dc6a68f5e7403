//! Results as a table for spreadsheets: a row a number, each with what it is and by what it was measured.

use impasto_runtime::technique::Choice as _;

use super::results::{Results, Row};

const HEAD: [&str; 12] = [
    "part", "scene", "variant", "what", "value", "unit", "command", "version", "device", "backend",
    "driver", "date",
];

/// The whole table.
pub fn csv(results: &Results) -> String {
    let mut out = line(&HEAD.map(String::from));
    for row in &results.rows {
        for (what, value, unit) in values(row) {
            let stamp = &row.stamp;
            let fields = [
                &row.part,
                &row.scene,
                &row.variant,
                &what,
                &value,
                &unit.to_owned(),
                &stamp.command,
                &stamp.version,
                &stamp.device,
                &stamp.backend,
                &stamp.driver,
                &stamp.date,
            ];
            out += &line(&fields.map(String::clone));
        }
    }
    out
}

/// What a row says: the name of each number, the number, and its unit.
fn values(row: &Row) -> Vec<(String, String, &'static str)> {
    let mut out = Vec::new();
    if let Some(why) = &row.failed {
        out.push(("failed".into(), why.clone(), ""));
    }
    for (at, rate) in row.rates.iter().enumerate() {
        out.push((format!("render {}", at + 1), rate.to_string(), "paths/s"));
    }
    for rate in &row.rays {
        let technique = [
            rate.traversal.name(),
            rate.stack.name(),
            rate.leaves.name(),
            rate.ray_fetch.name(),
        ];
        let what = format!("{} rays, {}", rate.rays.name(), technique.join(" "));
        out.push((what, rate.mrays_per_second.to_string(), "Mrays/s"));
    }
    let Some(scene) = &row.kernels else {
        return out;
    };
    let seconds = |what: String, value: f64| (what, value.to_string(), "s");
    out.push(seconds("logic".into(), scene.logic));
    out.push(seconds("other".into(), scene.other));
    for kernel in &scene.kernels {
        let members = kernel.1.iter().filter_map(|at| scene.materials.get(*at));
        let members: Vec<&str> = members.map(|m| m.name.as_str()).collect();
        let name = format!("{}:{}", kernel.0.name(), members.join(","));
        out.push(seconds(format!("{name} measured"), kernel.3));
        out.push(seconds(format!("{name} predicted"), kernel.2));
    }
    for render in &scene.renders {
        for rate in &render.rates {
            out.push((
                format!("render by {}", render.label),
                rate.to_string(),
                "paths/s",
            ));
        }
    }
    out
}

/// A line of fields, in quotes where they need some.
fn line(fields: &[String]) -> String {
    let quoted = fields.iter().map(|field| {
        if field.contains([',', '"', '\n', '\r']) {
            format!("\"{}\"", field.replace('"', "\"\""))
        } else {
            field.clone()
        }
    });
    quoted.collect::<Vec<_>>().join(",") + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiment::records::Stamp;

    #[test]
    fn every_number_comes_with_its_command_and_device() {
        let mut results = Results::new("x");
        results.rows.push(Row {
            part: "speed".into(),
            scene: "city".into(),
            variant: "mega, \"never\"".into(),
            stamp: Stamp {
                command: "impasto render".into(),
                device: "GPU".into(),
                date: "2026-11-30".into(),
                ..Stamp::default()
            },
            rates: vec![1.5, 2.0],
            ..Row::default()
        });
        let text = csv(&results);
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines.len(), 3);
        assert_eq!(
            lines[2],
            "speed,city,\"mega, \"\"never\"\"\",render 2,2,paths/s,impasto render,,GPU,,,2026-11-30"
        );
        results.rows[0].failed = Some("two\nlines".into());
        assert!(csv(&results).contains("failed,\"two\nlines\",,"));
    }
}
