//! `impasto experiment mixes`: mixes of materials by lot, as scenes in a folder.

use std::ops::RangeInclusive;
use std::path::PathBuf;

use clap::{Args, ValueHint};
use impasto::experiment::mixes::{Class, Draw, Hits, MOST, Shares, draw};
use impasto::experiment::run::write_mixes;

use crate::cli::completions::Known;
use crate::cli::{Global, Outcome, print};

#[derive(Args)]
pub(super) struct MixesArgs {
    /// How many
    #[arg(long, value_name = "N", default_value_t = 40, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    count: u32,
    /// Equal seeds give equal mixes
    #[arg(long, default_value_t = 0)]
    seed: u32,
    /// Numbers of materials, as in 1..16
    #[arg(long, value_name = "LEAST..MOST", default_value = "1..16", value_parser = parse_range)]
    materials: RangeInclusive<usize>,
    /// How the surface is shared out: even, skewed
    #[arg(long, value_name = "A,B", value_delimiter = ',', value_parser = Known::new(parse_shares, shares_names), hide_possible_values = true)]
    shares: Vec<Shares>,
    /// What neighbouring paths hit: random, coherent
    #[arg(long, value_name = "A,B", value_delimiter = ',', value_parser = Known::new(parse_hits, hits_names), hide_possible_values = true)]
    hits: Vec<Hits>,
    /// What materials cost: cheap, middling, noise, lobes, functions, integers, registers, loops
    #[arg(long, value_name = "A,B", value_delimiter = ',', value_parser = Known::new(parse_class, class_names), hide_possible_values = true)]
    classes: Vec<Class>,
    /// The folder to write scenes, materials and geometry to
    #[arg(short, long, value_name = "FOLDER", value_hint = ValueHint::DirPath)]
    out: PathBuf,
}

fn parse_range(text: &str) -> Result<RangeInclusive<usize>, String> {
    let wrong = || format!("expected numbers from 1 to {MOST}, as in 1..16 or 6");
    let (low, high) = text.split_once("..").unwrap_or((text, text));
    let number = |text: &str| {
        let number = text.trim_start_matches('=').trim().parse().ok();
        number.filter(|n| (1..=MOST).contains(n)).ok_or_else(wrong)
    };
    let (low, high) = (number(low)?, number(high)?);
    if low > high {
        return Err(wrong());
    }
    Ok(low..=high)
}

fn shares_names() -> Vec<&'static str> {
    Shares::ALL.iter().map(|s| s.name()).collect()
}

fn parse_shares(text: &str) -> Result<Shares, String> {
    named(text, &Shares::ALL.map(|s| (s.name(), s)))
}

fn hits_names() -> Vec<&'static str> {
    Hits::ALL.iter().map(|h| h.name()).collect()
}

fn parse_hits(text: &str) -> Result<Hits, String> {
    named(text, &Hits::ALL.map(|h| (h.name(), h)))
}

fn class_names() -> Vec<&'static str> {
    Class::ALL.iter().map(|c| c.name()).collect()
}

fn parse_class(text: &str) -> Result<Class, String> {
    named(text, &Class::ALL.map(|c| (c.name(), c)))
}

fn named<T: Copy>(text: &str, known: &[(&'static str, T)]) -> Result<T, String> {
    let found = known.iter().find(|(name, _)| *name == text);
    found.map(|(_, of)| *of).ok_or_else(|| {
        let names: Vec<&str> = known.iter().map(|(name, _)| *name).collect();
        format!("expected one of {}", names.join(", "))
    })
}

pub(super) fn run(args: &MixesArgs, _: &Global) -> Outcome {
    let usual = Draw::default();
    let or = |given: &[Class], usual: Vec<Class>| {
        if given.is_empty() {
            usual
        } else {
            given.to_vec()
        }
    };
    let of = Draw {
        count: args.count as usize,
        seed: args.seed.into(),
        materials: args.materials.clone(),
        hits: if args.hits.is_empty() {
            usual.hits
        } else {
            args.hits.clone()
        },
        shares: if args.shares.is_empty() {
            usual.shares
        } else {
            args.shares.clone()
        },
        classes: or(&args.classes, usual.classes),
    };
    let mixes = draw(&of);
    write_mixes(&mixes, &args.out)?;
    let line = |mix: &impasto::experiment::mixes::Mix| {
        let file = args.out.join(mix.file());
        let (hits, shares) = (mix.hits.name(), mix.shares.name());
        let about = &mix.about;
        format!(
            "{}: {about}; {hits} hits, {shares} shares: {}\n",
            file.display(),
            mix.materials.join(" ")
        )
    };
    print(&mixes.iter().map(line).collect::<String>())
}
