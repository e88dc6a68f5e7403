//! What the completion script for bash offers after each option: its values, files, or nothing.

use std::collections::BTreeMap;

use crate::cli::common::impasto;

/// What bash offers after an option.
#[derive(Debug, PartialEq)]
enum Offer {
    Values(Vec<String>),
    Files,
    Folders,
    Nothing,
}

/// The offers by command and option, as the script has them.
fn offers() -> BTreeMap<(String, String), Offer> {
    let script = impasto(&["completions", "bash"]).exits(0).stdout;
    let mut offers = BTreeMap::new();
    let (mut command, mut option) = (String::new(), String::new());
    for line in script.lines().map(str::trim) {
        if let Some(label) = line.strip_suffix(')').filter(|l| !l.contains(['(', ' '])) {
            if let Some((_, name)) = label.split_once("impasto__subcmd__") {
                command = name.replace("__subcmd__", " ");
            }
            option = label.to_owned();
        }
        let at = (command.clone(), option.clone());
        if !option.starts_with('-') {
            continue;
        }
        if let Some(reply) = line
            .strip_prefix("COMPREPLY=(")
            .and_then(|l| l.strip_suffix(')'))
        {
            let values = reply.strip_prefix("$(compgen -W \"");
            let values = values.and_then(|rest| rest.split_once('"'));
            let offer = match (values, reply) {
                (Some((values, _)), _) => Offer::Values(words(values)),
                (None, "\"${cur}\"") => Offer::Nothing,
                (None, "") => Offer::Folders,
                (None, reply) if reply.contains("compgen -f") => Offer::Files,
                _ => panic!("{at:?}: {reply}"),
            };
            offers.insert(at, offer);
        }
    }
    offers
}

fn words(text: &str) -> Vec<String> {
    text.split_whitespace().map(str::to_owned).collect()
}

#[test]
fn options_with_fixed_values_offer_them() {
    let offers = offers();
    for (command, option, values) in [
        (
            "render",
            "--strategy",
            "auto own mixed binned inline mega threshold paper exhaustive",
        ),
        (
            "plan",
            "--strategy",
            "auto own mixed binned inline mega threshold paper exhaustive",
        ),
        (
            "converge",
            "--strategies",
            "auto own mixed binned inline mega threshold paper",
        ),
        ("converge", "--samplers", "sobol owen independent"),
        ("render", "--sampler", "sobol owen independent"),
        ("render", "--device", "gpu cpu"),
        ("info", "--device", "gpu cpu"),
        ("render", "--on", "ball cloth plane"),
        ("render", "--until", "relmse= rmse= time="),
        ("emit", "--what", "tokens ast ir wgsl params docs"),
        ("emit", "--target", "native webgpu"),
        ("check", "--format", "text json"),
        ("check", "--color", "auto always never"),
        ("trace", "--precision", "32 64 both"),
    ] {
        let at = (command.to_owned(), option.to_owned());
        assert_eq!(
            offers.get(&at),
            Some(&Offer::Values(words(values))),
            "{at:?}"
        );
    }
    let at = ("render".to_owned(), "--aov".to_owned());
    let Some(Offer::Values(outputs)) = offers.get(&at) else {
        panic!("{:?}", offers.get(&at));
    };
    assert!(outputs.contains(&"albedo".to_owned()) && outputs.contains(&"lights".to_owned()));
    assert!(!outputs.contains(&"light_GROUP".to_owned()));
}

/// Options that take files offer files, and no other does.
#[test]
fn files_are_offered_where_files_are_taken() {
    let mut files: Vec<String> = Vec::new();
    let mut folders = Vec::new();
    for ((command, option), offer) in offers() {
        match offer {
            Offer::Files => files.push(format!("{command} {option}")),
            Offer::Folders => folders.push(format!("{command} {option}")),
            _ => {}
        }
    }
    assert_eq!(
        folders,
        [
            "converge --out",
            "converge -o",
            "experiment --farm",
            "experiment --out",
            "experiment -o",
            "experiment mixes --out",
            "experiment mixes -o",
            "farm new --out",
            "farm new -o",
            "import --out"
        ]
    );
    assert_eq!(
        files,
        [
            "calibrate --data",
            "calibrate --from",
            "calibrate --out",
            "calibrate --score",
            "calibrate -o",
            "converge --reference",
            "emit --out",
            "emit -o",
            "experiment --data",
            "export --out",
            "export -o",
            "farm new --commands",
            "merge --out",
            "merge -o",
            "plan --plan",
            "plan --profile",
            "plan --save",
            "plan --save-workload",
            "plan --workload",
            "render --checkpoint",
            "render --device-profile",
            "render --out",
            "render --plan",
            "render --report",
            "render -o",
            "test --junit",
            "view --compare",
            "view --out",
            "view -o",
        ]
    );
}

/// Headings of `--help` are above the options that they are of.
#[test]
fn headings_are_of_what_is_below_them() {
    for (command, heading, below, above) in [
        ("render", "Techniques", "--ray-order", "--turntable"),
        (
            "plan",
            "With --strategy exhaustive",
            "--repetitions",
            "--device",
        ),
    ] {
        let help = impasto(&[command, "--help"]).exits(0).stdout;
        let at = |text: &str| {
            let found = help.find(&format!("{text} "));
            found.or_else(|| help.find(&format!("{text}:")))
        };
        let [heading, below, above] = [heading, below, above].map(at);
        assert!(above.is_some() && heading > above, "{help}");
        assert!(below > heading, "{help}");
    }
}
