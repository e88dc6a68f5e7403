//! Runs the command on hostile files for some time, and keeps what harms it: see `impasto_fuzz::hostile`.

use std::process::ExitCode;

fn main() -> ExitCode {
    #[cfg(unix)]
    return impasto_fuzz::hostile::main();
    #[cfg(not(unix))]
    {
        eprintln!("the limits that processes run under are those of Unix");
        return ExitCode::from(2);
    }
}
