//! Runs a material's body with numbers that are sums of products, in place of the numbers at one point.
//!
//! Statements, branches, loops and calls run as they are written, as far as what decides them is known. What is not a
//! sum of products afterwards has a reason. Work is bounded by [`FUEL`], and nesting by [`DEEPEST`].

use std::rc::Rc;

use super::operate::combined;
use super::sum::{Atom, COLOR, Part, Sum, Why};
use super::value::{Sym, composed, store, swizzled};
use crate::ir::ops::{CostClass, Op};
use crate::ir::{Block, Const, ExprId, ExprKind, Function, FunctionId, Module, Stmt, Type};
use crate::source::{FileId, Span};

/// Most expressions that are evaluated.
const FUEL: u64 = 1 << 20;

/// How deep calls and blocks may lie in each other.
const DEEPEST: usize = 128;

/// Most different lookups and normal maps.
const MOST: usize = 256;

/// A lookup of a picture.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Looked {
    pub texture: usize,
    pub at: [Sum; 2],
    pub mode: i32,
}

/// A normal that `std::pattern::normal_map` gives.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Bent {
    pub map: [Sum; 3],
    pub scale: f64,
    pub flip_green: bool,
}

/// What a run of statements ends with.
enum Flow {
    Next,
    Break,
    Continue,
    /// Nobody knows where it goes on.
    Lost(Why),
}

/// A function that runs.
pub(super) struct Frame {
    values: Vec<Option<Sym>>,
    locals: Vec<Sym>,
    args: Vec<Sym>,
}

pub(super) struct Evaluator<'a> {
    module: &'a Module,
    /// The values of the material's parameters.
    params: Vec<Sym>,
    /// The file that defines `normal_map`.
    normal_map: Option<FileId>,
    /// The fields of the surface point that normals and tangents are.
    directions: [Vec<Part>; 2],
    pub lookups: Vec<Looked>,
    pub bent: Vec<Bent>,
    fuel: u64,
    depth: usize,
}

impl<'a> Evaluator<'a> {
    pub fn new(module: &'a Module, params: &[Const], normal_map: Option<FileId>) -> Self {
        Self {
            module,
            params: params.iter().map(Sym::constant).collect(),
            normal_map,
            directions: [Vec::new(), Vec::new()],
            lookups: Vec::new(),
            bent: Vec::new(),
            fuel: FUEL,
            depth: 0,
        }
    }

    /// Runs the body of a material, of which any expression can be asked for afterwards.
    pub fn material(&mut self, body: &Function) -> Frame {
        let point = body.params.first().map(|param| self.point(param.ty, body));
        self.run(body, point.into_iter().collect())
    }

    /// The value of an expression.
    pub fn value(&self, f: &Function, frame: &Frame, id: ExprId) -> Sym {
        let expr = f.expr(id);
        let value = match &expr.kind {
            ExprKind::Const(constant) => Some(Sym::constant(constant)),
            ExprKind::Param(index) => frame.args.get(*index as usize).cloned(),
            ExprKind::MaterialParam(index) => self.params.get(*index as usize).cloned(),
            _ => frame.values.get(id.index()).cloned().flatten(),
        };
        value.unwrap_or_else(|| Sym::Unknown(Why::new(expr.span, "what is not computed")))
    }

    /// The surface point: a number of its own for each component of its fields.
    fn point(&mut self, ty: Type, body: &Function) -> Sym {
        let Type::Struct(id) = ty else {
            return Sym::Unknown(Why::new(body.span, "the surface"));
        };
        let fields = &self.module.structs[id.index()].fields;
        let field = |(index, (name, ty)): (usize, &(String, Type))| {
            let why = || Why::new(body.span, format!("`{name}`"));
            match ty.width() {
                Some(width) => {
                    let atom = |c: usize| Atom::Input(index as u32, c as u8);
                    Sym::Floats((0..width).map(|c| Ok(Sum::atom(atom(c)))).collect())
                }
                None => Sym::Unknown(why()),
            }
        };
        let values: Vec<Sym> = fields.iter().enumerate().map(field).collect();
        for (name, direction) in ["normal", "tangent"].into_iter().zip(&mut self.directions) {
            let index = fields.iter().position(|(own, _)| own == name);
            if let Some(Sym::Floats(parts)) = index.map(|index| &values[index]) {
                direction.clone_from(parts);
            }
        }
        Sym::Struct(Rc::new(values))
    }

    fn run(&mut self, f: &Function, args: Vec<Sym>) -> Frame {
        let locals = f.locals.iter().map(|local| self.zero(local.ty));
        let mut frame = Frame {
            values: vec![None; f.exprs.len()],
            locals: locals.collect(),
            args,
        };
        self.fuel = self.fuel.saturating_sub(f.exprs.len() as u64);
        self.block(f, &f.body, &mut frame);
        frame
    }

    fn block(&mut self, f: &Function, block: &Block, frame: &mut Frame) -> Flow {
        if self.depth >= DEEPEST {
            let why = Why::new(f.span, "what lies too deep in calls and blocks");
            taint(block, frame, &why);
            return Flow::Next;
        }
        self.depth += 1;
        let flow = self.statements(f, block, frame);
        self.depth -= 1;
        flow
    }

    fn statements(&mut self, f: &Function, block: &Block, frame: &mut Frame) -> Flow {
        for stmt in block {
            let flow = match stmt {
                Stmt::Eval(id) => {
                    let value = self.evaluated(f, frame, *id);
                    frame.values[id.index()] = Some(value);
                    Flow::Next
                }
                Stmt::Store(local, component, id) => {
                    let value = self.value(f, frame, *id);
                    store(&mut frame.locals[local.index()], *component, value);
                    Flow::Next
                }
                Stmt::If(cond, a, b) => match self.value(f, frame, *cond) {
                    Sym::Bool(true) => self.block(f, a, frame),
                    Sym::Bool(false) => self.block(f, b, frame),
                    other => {
                        let why = other.why(f.expr(*cond).span);
                        if leaves(a) || leaves(b) {
                            return Flow::Lost(why);
                        }
                        taint(a, frame, &why);
                        taint(b, frame, &why);
                        Flow::Next
                    }
                },
                Stmt::For {
                    local,
                    low,
                    high,
                    body,
                } => {
                    let bounds = [*low, *high].map(|id| self.value(f, frame, id));
                    match bounds {
                        [Sym::Int(low), Sym::Int(high)] => {
                            for i in low..high {
                                frame.locals[local.index()] = Sym::Int(i);
                                if !self.turn(f, body, frame) {
                                    break;
                                }
                            }
                        }
                        [low, high] => {
                            let why = low.first_why().unwrap_or_else(|| high.why(f.span));
                            taint(body, frame, &why);
                        }
                    }
                    Flow::Next
                }
                Stmt::While {
                    head,
                    test,
                    limit,
                    body,
                } => {
                    for _ in 0..*limit {
                        self.block(f, head, frame);
                        match self.value(f, frame, *test) {
                            Sym::Bool(true) if self.turn(f, body, frame) => {}
                            Sym::Bool(_) => break,
                            other => {
                                let why = other.why(f.expr(*test).span);
                                taint(head, frame, &why);
                                taint(body, frame, &why);
                                break;
                            }
                        }
                    }
                    Flow::Next
                }
                Stmt::Break => Flow::Break,
                Stmt::Continue => Flow::Continue,
            };
            if !matches!(flow, Flow::Next) {
                return flow;
            }
        }
        Flow::Next
    }

    /// A turn of a loop. Are there more?
    fn turn(&mut self, f: &Function, body: &Block, frame: &mut Frame) -> bool {
        self.fuel = self.fuel.saturating_sub(1);
        let lost = if self.fuel == 0 {
            Some(self.spent(f.span))
        } else {
            match self.block(f, body, frame) {
                Flow::Next | Flow::Continue => return true,
                Flow::Break => None,
                Flow::Lost(why) => Some(why),
            }
        };
        if let Some(why) = lost {
            taint(body, frame, &why);
        }
        false
    }

    fn spent(&self, span: Span) -> Why {
        Why::new(span, "what takes too long to compute")
    }

    fn evaluated(&mut self, f: &Function, frame: &Frame, id: ExprId) -> Sym {
        let expr = f.expr(id);
        if self.fuel == 0 {
            return Sym::Unknown(self.spent(expr.span));
        }
        self.fuel -= 1;
        let operands = expr.kind.operands().iter();
        let args: Vec<Sym> = operands.map(|&id| self.value(f, frame, id)).collect();
        match &expr.kind {
            ExprKind::Load(local) => frame.locals[local.index()].clone(),
            ExprKind::Op(op, _) if op.info().class == CostClass::Texture => {
                self.lookup(*op, &args, expr.ty, expr.span)
            }
            ExprKind::Op(op, _) => combined(*op, &args, expr.ty, expr.span),
            ExprKind::Compose(_) => composed(&args, expr.ty, expr.span),
            ExprKind::Swizzle(_, picked) => swizzled(&args[0], picked, expr.span),
            ExprKind::Call(callee, _) => self.call(*callee, args, expr.span),
            ExprKind::Make(..) => Sym::Struct(Rc::new(args)),
            ExprKind::Field(_, index) => match &args[0] {
                Sym::Struct(fields) => match &fields[*index as usize] {
                    // A field of the surface, which is read here.
                    Sym::Unknown(why) if why.span == f.span => {
                        Sym::Unknown(Why::new(expr.span, why.what.clone()))
                    }
                    field => field.clone(),
                },
                other => Sym::Unknown(other.why(expr.span)),
            },
            _ => self.value(f, frame, id),
        }
    }

    fn call(&mut self, callee: FunctionId, args: Vec<Sym>, span: Span) -> Sym {
        let f = &self.module.functions[callee.index()];
        if self.normal_map == Some(f.span.file)
            && f.name == "normal_map"
            && let Some(bent) = self.bend(&args)
        {
            return bent;
        }
        let frame = self.run(f, args);
        let value = self.value(f, &frame, f.value);
        if f.span.file.is_library() && !span.file.is_library() {
            let why = Why::new(span, format!("`{}`", f.name));
            return value.by_caller(&why);
        }
        value
    }

    /// What `normal_map` gives of a picture, for the normal and the tangent of the surface.
    fn bend(&mut self, args: &[Sym]) -> Option<Sym> {
        let [
            Sym::Floats(map),
            Sym::Floats(normal),
            Sym::Floats(tangent),
            scale,
            flip,
        ] = args
        else {
            return None;
        };
        if self.directions[0] != *normal || self.directions[1] != *tangent {
            return None;
        }
        let map: Vec<Sum> = map.iter().cloned().collect::<Result<_, _>>().ok()?;
        let bent = Bent {
            map: map.try_into().ok()?,
            scale: match scale {
                Sym::Floats(parts) => parts.first()?.as_ref().ok()?.known()?,
                _ => return None,
            },
            flip_green: match flip {
                Sym::Bool(flip) => *flip,
                _ => return None,
            },
        };
        let index = interned(&mut self.bent, bent)?;
        let part = |c| Ok(Sum::atom(Atom::Bent(index, c)));
        Some(Sym::Floats((0..3).map(part).collect()))
    }

    fn lookup(&mut self, op: Op, args: &[Sym], ty: Type, span: Span) -> Sym {
        match self.looked_up(op, args, ty) {
            Ok(value) => value,
            Err(what) => {
                let why = args.iter().find_map(Sym::first_why);
                Sym::Unknown(why.unwrap_or_else(|| Why::new(span, what)))
            }
        }
    }

    fn looked_up(&mut self, op: Op, args: &[Sym], ty: Type) -> Result<Sym, &'static str> {
        let (Sym::Int(texture), Sym::Floats(at)) = (&args[0], &args[1]) else {
            return Err("a picture that is chosen while rendering");
        };
        let mode = match args.get(2) {
            None => 0,
            Some(Sym::Int(mode)) => *mode,
            Some(_) => return Err("a lookup that wraps in a way chosen while rendering"),
        };
        let at: Result<Vec<Sum>, Why> = at.iter().cloned().collect();
        let at = at.map_err(|_| "a place that is computed")?;
        if at[2..].iter().any(|width| width.known() != Some(0.0)) {
            return Err("a picture that is averaged over a width");
        }
        let at = [at[0].clone(), at[1].clone()];
        let texture = usize::try_from(*texture).map_err(|_| "a picture without a file")?;
        let looked = Looked { texture, at, mode };
        let index = interned(&mut self.lookups, looked).ok_or("too many lookups of pictures")?;
        let first = match op {
            Op::Image | Op::ImageAs => COLOR,
            Op::ImageAlpha | Op::ImageAlphaAs => 3,
            _ => 0,
        };
        let channels = 0..ty.width().unwrap_or(1) as u8;
        let texel = |c| Ok(Sum::atom(Atom::Texel(index, first + c)));
        Ok(Sym::Floats(channels.map(texel).collect()))
    }

    fn zero(&self, ty: Type) -> Sym {
        match ty {
            Type::Bool => Sym::Bool(false),
            Type::Int => Sym::Int(0),
            Type::Mat3 => Sym::Mat3(vec![vec![Ok(Sum::default()); 3]; 3]),
            Type::Struct(id) => {
                let fields = self.module.structs[id.index()].fields.iter();
                Sym::Struct(Rc::new(fields.map(|(_, ty)| self.zero(*ty)).collect()))
            }
            _ => Sym::Floats(vec![Ok(Sum::default()); ty.width().unwrap_or(1)]),
        }
    }
}

/// The number of an entry of a list, which is added if it is new; none if the list is full.
fn interned<T: PartialEq>(list: &mut Vec<T>, entry: T) -> Option<u32> {
    let found = list.iter().position(|own| *own == entry);
    let index = found.or_else(|| {
        (list.len() < MOST).then(|| {
            list.push(entry);
            list.len() - 1
        })
    });
    index.map(|index| index as u32)
}

/// Does a block leave the loop around it, or its turn?
fn leaves(block: &Block) -> bool {
    block.iter().any(|stmt| match stmt {
        Stmt::Break | Stmt::Continue => true,
        Stmt::If(_, a, b) => leaves(a) || leaves(b),
        _ => false,
    })
}

/// Nothing that a block computes or assigns is known.
fn taint(block: &Block, frame: &mut Frame, why: &Why) {
    for stmt in block {
        match stmt {
            Stmt::Eval(id) => frame.values[id.index()] = Some(Sym::Unknown(why.clone())),
            Stmt::Store(local, ..) => frame.locals[local.index()] = Sym::Unknown(why.clone()),
            Stmt::If(_, a, b) => {
                taint(a, frame, why);
                taint(b, frame, why);
            }
            Stmt::For { body, local, .. } => {
                frame.locals[local.index()] = Sym::Unknown(why.clone());
                taint(body, frame, why);
            }
            Stmt::While { head, body, .. } => {
                taint(head, frame, why);
                taint(body, frame, why);
            }
            Stmt::Break | Stmt::Continue => {}
        }
    }
}
