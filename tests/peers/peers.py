#!/usr/bin/env python3
"""Impasto beside Mitsuba 3 and Blender's Cycles (README.md says how to run it).

`compare` renders scenes of plain BSDFs with Impasto and Mitsuba and asks whether the pictures are the
same but for noise. `race` renders scenes with Impasto and either of the two on one GPU and writes how fast
they are, and how long they take to equal error.
"""

import argparse
import sys
import tempfile
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    comparing = commands.add_parser("compare", help="are the pictures the same but for noise?")
    comparing.add_argument("scenes", nargs="*", type=Path, help="scene files [all in tests/peers/scenes]")
    comparing.add_argument("--size", type=int, default=128, help="pixels along each side")
    comparing.add_argument("--spp", type=int, default=256, help="samples of each of two halves")
    comparing.add_argument("--keep", type=Path, help="folder to keep the pictures in")
    racing = commands.add_parser("race", help="paths a second and time to equal error")
    racing.add_argument("scenes", nargs="+", type=Path)
    racing.add_argument("--size", type=size, help="as in 640x480; the scene's own otherwise")
    racing.add_argument("--spp", type=int, default=64, help="samples of a picture")
    racing.add_argument("--pictures", type=int, default=6, help="pictures with seeds of their own")
    racing.add_argument("--option", action="append", default=[], help="for `impasto render`, repeatable")
    racing.add_argument("--out", type=Path, default=Path("peers"), help="writes OUT.json and OUT.md")
    racing.add_argument("--add", action="store_true", help="keep the other scenes of OUT.json")
    racing.add_argument("--peer", choices=["mitsuba", "cycles"], default="mitsuba")
    racing.add_argument("--cycles", default="python3.11", help="a Python that has bpy [python3.11]")
    racing.add_argument("--cycles-device", default="CUDA", help="CUDA, OPTIX, HIP or CPU [CUDA]")
    racing.add_argument("--mode", action="append", help="of the peer, repeatable [all that README.md names]")
    for command in (comparing, racing):
        command.add_argument("--impasto", default=str(ROOT / "target/release/impasto"), help="the command")
        command.add_argument("--variant", help="of Mitsuba [compare: llvm_ad_rgb, race: cuda_ad_rgb]")
    args = parser.parse_args()
    if args.command == "compare" or args.peer == "mitsuba":
        import mitsuba as mi

        mi.set_variant(args.variant or ("llvm_ad_rgb" if args.command == "compare" else "cuda_ad_rgb"))
    if args.command == "compare":
        return compare(args)
    from race import race

    return race(args)


def size(text: str) -> tuple[int, int]:
    width, height = text.split("x")
    return int(width), int(height)


def compare(args: argparse.Namespace) -> int:
    import mitsuba as mi

    import exr
    from impasto import Impasto, load_scene
    from measure import compare as compare_pictures
    from translate import load, translate

    impasto = Impasto(args.impasto)
    scenes = args.scenes or sorted((HERE / "scenes").glob("*.toml"))
    if not scenes:
        raise SystemExit("there are no scenes to compare")
    disagree = 0
    with tempfile.TemporaryDirectory() as temporary:
        folder = args.keep or Path(temporary)
        folder.mkdir(parents=True, exist_ok=True)
        print(f"{'scene':16} {'relMSE':>9} {'noise':>9} {'bias':>9} {'allowed':>9}  mean ratio")
        for path in scenes:
            peer = load(translate(load_scene(path), impasto, (args.size, args.size)))
            ours, theirs = [], []
            for seed in (1, 2):
                out = folder / f"{path.stem}-impasto-{seed}.exr"
                options = ["--size", f"{args.size}x{args.size}", "--spp", str(args.spp), "--seed", str(seed)]
                impasto.render(path, out, *options)
                ours.append(exr.read(out))
                picture = mi.render(peer, spp=args.spp, seed=seed)
                mi.Bitmap(picture).write(str(folder / f"{path.stem}-mitsuba-{seed}.exr"))
                mi.util.write_bitmap(str(folder / f"{path.stem}-mitsuba-{seed}.png"), picture, write_async=False)
                theirs.append(np.array(picture, dtype=np.float64))
            v = compare_pictures(ours, theirs)
            word = "agrees" if v.agrees else "DIFFERS"
            print(
                f"{path.stem:16} {v.difference:9.2e} {v.noise:9.2e} {v.bias:9.2e} {v.allowed:9.2e}  "
                f"{v.mean_ratio:.4f} {word}",
                flush=True,
            )
            disagree += not v.agrees
    return 1 if disagree else 0


if __name__ == "__main__":
    sys.exit(main())
