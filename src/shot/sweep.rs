//! Sweeps: a picture for each of several values of one or two parameters, on one sheet.

use impasto_compiler::{MaterialRequest, Program};
use impasto_runtime::error::SceneError;
use impasto_runtime::scene::{Asked, FilmSettings, GivenParam};

use super::Subject;
use super::sheet::Layout;
use crate::driver;

/// Most steps of one parameter.
pub const MAX_STEPS: u64 = 256;
/// Most pictures on a sheet.
pub const MAX_CELLS: usize = 1024;
/// Pixels of the longest side of a picture on a sheet, unless another size is asked for.
pub const CELL: u32 = 256;
/// Most columns of a sheet of one parameter.
const MAX_COLUMNS: usize = 8;

/// A parameter that has several values.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// Its name for people.
    pub label: String,
    /// Its values, at least two.
    pub steps: Vec<GivenParam>,
}

/// A sheet of pictures.
#[derive(Clone, Debug)]
pub struct Sweep {
    axes: Vec<Axis>,
}

impl Sweep {
    /// Of one parameter, or of one for columns and one for rows.
    ///
    /// # Errors
    /// If it is of more, or would have too many pictures.
    pub fn new(axes: Vec<Axis>) -> Result<Self, String> {
        if axes.len() > 2 {
            let names: Vec<String> = axes.iter().map(|a| format!("`{}`", a.label)).collect();
            return Err(format!(
                "a sheet has columns and rows, so at most two parameters may vary, not {}",
                names.join(", ")
            ));
        }
        let sweep = Self { axes };
        let cells = sweep.count();
        if cells > MAX_CELLS {
            return Err(format!(
                "a sheet of {cells} pictures is too large: at most {MAX_CELLS}"
            ));
        }
        Ok(sweep)
    }

    /// How many pictures there are.
    pub fn count(&self) -> usize {
        self.axes.iter().map(|axis| axis.steps.len()).product()
    }

    /// Columns of the sheet: the values of the first of two parameters, or as many as make it about as high as wide.
    fn columns(&self) -> usize {
        match &self.axes[..] {
            [columns, _] => columns.steps.len(),
            _ if self.count() <= 6 => self.count(),
            _ => ((self.count() as f64).sqrt().ceil() as usize).min(MAX_COLUMNS),
        }
    }

    /// The values of a picture.
    pub fn cell(&self, index: usize) -> Vec<GivenParam> {
        let of = |(axis, step): (&Axis, usize)| axis.steps[step].clone();
        self.axes.iter().zip(self.place(index)).map(of).collect()
    }

    /// What is written below a picture, a line a parameter.
    pub fn label(&self, index: usize) -> Vec<String> {
        let of =
            |(axis, step): (&Axis, usize)| format!("{} = {}", axis.label, axis.steps[step].value);
        self.axes.iter().zip(self.place(index)).map(of).collect()
    }

    /// The step of each parameter.
    fn place(&self, index: usize) -> [usize; 2] {
        let first = self.axes.first().map_or(1, |axis| axis.steps.len());
        [index % first, index / first]
    }

    /// Where the pictures and their labels are on a sheet.
    ///
    /// # Errors
    /// If it is too large for one picture.
    pub fn layout(&self, cell: FilmSettings) -> Result<Layout, String> {
        Layout::new(self.count(), self.columns(), self.axes.len(), cell)
    }

    /// The materials of all pictures, to be compiled together so that they share code, and how many each has.
    ///
    /// # Errors
    /// The first thing that is wrong with the scene.
    pub fn requests(
        &self,
        subject: &Subject,
        asked: &Asked,
    ) -> Result<(Vec<MaterialRequest>, Vec<usize>), SceneError> {
        let (mut requests, mut counts) = (Vec::new(), Vec::new());
        for index in 0..self.count() {
            let scene = subject.scene(&self.asked(asked, index))?;
            requests.extend(driver::requests(&scene));
            counts.push(scene.materials.len());
        }
        Ok((requests, counts))
    }

    /// What is asked of the subject for a picture.
    pub fn asked(&self, asked: &Asked, index: usize) -> Asked {
        let mut asked = asked.clone();
        asked.given.extend(self.cell(index));
        asked
    }
}

/// The size of a picture on a sheet: what is asked for, or else that of the scene, made smaller until it fits.
pub fn cell_size(asked: Option<(u32, u32)>, film: FilmSettings) -> FilmSettings {
    if let Some((width, height)) = asked {
        return FilmSettings { width, height };
    }
    let longest = film.width.max(film.height);
    let scaled = |side: u32| (u64::from(side) * u64::from(CELL) / u64::from(longest)).max(1) as u32;
    if longest <= CELL {
        return film;
    }
    FilmSettings {
        width: scaled(film.width),
        height: scaled(film.height),
    }
}

/// Where the instances of each picture begin in the program that all were compiled to.
pub fn firsts(counts: &[usize]) -> Vec<usize> {
    let mut next = 0;
    let first = |count: &usize| {
        let first = next;
        next += count;
        first
    };
    counts.iter().map(first).collect()
}

/// Do all pictures of a sheet run the same code?
pub fn shares_code(program: &Program, counts: &[usize]) -> bool {
    let materials = |first: &usize| -> Vec<usize> {
        let own = program.instances().iter().skip(*first);
        own.take(counts.first().copied().unwrap_or(0))
            .map(|i| i.info.material)
            .collect()
    };
    let all: Vec<Vec<usize>> = firsts(counts).iter().map(materials).collect();
    all.windows(2).all(|pair| pair[0] == pair[1])
}
