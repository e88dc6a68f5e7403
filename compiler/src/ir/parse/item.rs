//! What a text is made of: textures, structs, functions, closure definitions, materials.

use std::collections::BTreeMap;

use super::body::Body;
use super::{Parser, Result, Token, Wrong};
use crate::ir::{ClosureDef, ClosureDefId, Function, FunctionId, Methods, Struct, StructId};
use crate::source::Span;

impl Parser {
    pub(super) fn item(&mut self) -> Result<()> {
        let start = self.here();
        let word = match self.peek() {
            Token::Ident(word) => word.clone(),
            _ => String::new(),
        };
        match word.as_str() {
            "texture" => self.texture(),
            "struct" => self.structure(start),
            "fn" => self.function(start),
            "bsdf" | "delta" => self.bsdf(start),
            "edf" => self.edf(start),
            "material" => self.material(start),
            _ => self
                .unexpected("`texture`, `struct`, `fn`, `bsdf`, `delta bsdf`, `edf` or `material`"),
        }
    }

    /// `texture "path"`
    fn texture(&mut self) -> Result<()> {
        self.next();
        let Token::Str(path) = self.peek() else {
            return self.unexpected("the path of an image file in quotes");
        };
        let path = path.clone();
        self.next();
        self.parsed.module.textures.push(path);
        Ok(())
    }

    /// The name that an item defines, which `known` must not have.
    fn new_name<T>(&mut self, known: fn(&Self) -> &BTreeMap<String, T>) -> Result<String> {
        let at = self.here();
        let name = self.name("a name")?;
        if known(self).contains_key(&name) {
            let message = format!("`{name}` is defined twice");
            return Err(Wrong::new(at, message).expected("another name"));
        }
        Ok(name)
    }

    /// `struct Name { field: type ... }`
    fn structure(&mut self, start: Span) -> Result<()> {
        self.next();
        let at = self.here();
        let name = self.new_name(|p| &p.structs)?;
        if self.type_named(&name).is_some() {
            let message = format!("`{name}` is a type already");
            return Err(Wrong::new(at, message).expected("another name"));
        }
        self.expect("{")?;
        let mut fields: BTreeMap<String, ()> = BTreeMap::new();
        let mut all = Vec::new();
        while !self.eat("}") {
            let at = self.here();
            let field = self.local()?;
            if fields.insert(field.name.clone(), ()).is_some() {
                let message = format!("field `{}` is there twice", field.name);
                return Err(Wrong::new(at, message).expected("another name"));
            }
            all.push((field.name, field.ty));
        }
        let id = StructId(self.parsed.module.structs.len() as u32);
        self.structs.insert(name.clone(), id);
        self.parsed.module.structs.push(Struct {
            name,
            fields: all,
            span: self.since(start),
        });
        Ok(())
    }

    /// `fn name(params) -> type { ... return value }`
    fn function(&mut self, start: Span) -> Result<()> {
        self.next();
        let name = self.new_name(|p| &p.functions)?;
        let params = self.params()?;
        self.expect("->")?;
        let result = self.ty()?;
        let turns = if self.eat_word("turns") {
            self.count(u64::MAX, "a number of turns")?.max(1)
        } else {
            1
        };
        let mut body = Body::new(self, params);
        body.open()?;
        body.block_until(|p| p.is_word("return"))?;
        let value = body.returned()?;
        let built = body.finish()?;
        let span = self.since(start);
        let id = FunctionId(self.parsed.module.functions.len() as u32);
        self.functions.insert(name.clone(), id);
        self.parsed.module.functions.push(Function {
            name,
            result,
            value,
            turns,
            span,
            ..built
        });
        Ok(())
    }

    /// `bsdf name(params) { sample = f eval = f pdf = f albedo = f [passes = f] [walk = f] }`
    fn bsdf(&mut self, start: Span) -> Result<()> {
        let delta = self.eat_word("delta");
        self.expect_word("bsdf")?;
        self.closure(start, delta, |p| {
            Ok(Methods::Bsdf {
                sample: p.method("sample")?,
                eval: p.method("eval")?,
                pdf: p.method("pdf")?,
                albedo: p.method("albedo")?,
                passes: p
                    .is_word("passes")
                    .then(|| p.method("passes"))
                    .transpose()?,
                walk: p.is_word("walk").then(|| p.method("walk")).transpose()?,
            })
        })
    }

    /// `edf name(params) { emit = f }`
    fn edf(&mut self, start: Span) -> Result<()> {
        self.next();
        self.closure(start, false, |p| {
            Ok(Methods::Edf {
                emit: p.method("emit")?,
            })
        })
    }

    fn closure(
        &mut self,
        start: Span,
        delta: bool,
        methods: fn(&mut Self) -> Result<Methods>,
    ) -> Result<()> {
        let name = self.new_name(|p| &p.closures)?;
        let params = self.params()?;
        self.expect("{")?;
        let methods = methods(self)?;
        self.expect("}")?;
        let id = ClosureDefId(self.parsed.module.closures.len() as u32);
        self.closures.insert(name.clone(), id);
        self.parsed.module.closures.push(ClosureDef {
            name,
            delta,
            params,
            methods,
            span: self.since(start),
        });
        Ok(())
    }

    /// `name = function`
    fn method(&mut self, name: &str) -> Result<FunctionId> {
        self.expect_word(name)?;
        self.expect("=")?;
        self.callee()
    }

    /// The name of a function defined above.
    pub(super) fn callee(&mut self) -> Result<FunctionId> {
        let at = self.here();
        let name = self.name("the name of a function")?;
        self.functions.get(&name).copied().ok_or_else(|| {
            Wrong::new(at, format!("unknown function `{name}`"))
                .expected("a function defined above")
        })
    }
}
