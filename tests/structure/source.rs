//! What the check has to know about one file: the paths in it, the names it defines, and how long its functions are.

use proc_macro2::{TokenStream, TokenTree};
use syn::visit::{self, Visit};

/// A path as it is written, without what follows the last name.
pub(crate) type Names = Vec<String>;

/// An imported path. The last name of a glob import is `*`.
pub(crate) struct Import {
    pub(crate) path: Names,
    /// What it is called here.
    pub(crate) name: String,
}

/// A function with its length in lines and its number of arguments: 0 for one that implements a trait, which says what
/// the arguments are.
pub(crate) struct Function {
    pub(crate) name: String,
    pub(crate) lines: usize,
    pub(crate) arguments: usize,
}

/// What is in a file, leaving out what is compiled for tests only, except for `functions`.
#[derive(Default)]
pub(crate) struct Source {
    pub(crate) imports: Vec<Import>,
    /// Paths of two names or more.
    pub(crate) paths: Vec<Names>,
    pub(crate) types: Vec<String>,
    pub(crate) functions: Vec<Function>,
    /// How many test modules the visitor is in.
    in_tests: usize,
    /// Whether the visitor is in the implementation of a trait.
    in_trait: bool,
}

impl Source {
    pub(crate) fn of(text: &str) -> syn::Result<Self> {
        let file = syn::parse_file(text)?;
        let mut source = Self::default();
        source.visit_file(&file);
        Ok(source)
    }

    fn add_function(&mut self, signature: &syn::Signature, body: Option<&syn::Block>) {
        let start = signature.fn_token.span.end().line;
        let end = body.map_or(start, |body| body.brace_token.span.close().end().line);
        let arguments = if self.in_trait { 0 } else { signature.inputs.len() };
        let name = signature.ident.to_string();
        self.functions.push(Function { name, lines: end - start + 1, arguments });
    }

    fn add_path(&mut self, path: Names) {
        if path.len() > 1 && self.in_tests == 0 {
            self.paths.push(path);
        }
    }

    fn add_imports(&mut self, before: &[String], tree: &syn::UseTree) {
        let with = |name: &syn::Ident| before.iter().cloned().chain([name.to_string()]).collect::<Names>();
        let (path, name) = match tree {
            syn::UseTree::Path(part) => return self.add_imports(&with(&part.ident), &part.tree),
            syn::UseTree::Group(group) => {
                return group.items.iter().for_each(|tree| self.add_imports(before, tree));
            }
            syn::UseTree::Name(name) if name.ident == "self" => {
                (before.to_vec(), before[before.len() - 1].clone())
            }
            syn::UseTree::Name(name) => (with(&name.ident), name.ident.to_string()),
            syn::UseTree::Rename(renamed) if renamed.ident == "self" => {
                (before.to_vec(), renamed.rename.to_string())
            }
            syn::UseTree::Rename(renamed) => (with(&renamed.ident), renamed.rename.to_string()),
            _ => (before.iter().cloned().chain(["*".to_owned()]).collect(), "*".to_owned()),
        };
        self.imports.push(Import { path, name });
    }

    /// Paths in the arguments of a macro, which may be anything.
    fn add_tokens(&mut self, tokens: TokenStream) {
        let (mut path, mut colons) = (Names::new(), 0);
        for token in tokens {
            match token {
                TokenTree::Punct(punct) if punct.as_char() == ':' => colons += 1,
                TokenTree::Ident(name) => {
                    if colons != 2 {
                        self.add_path(std::mem::take(&mut path));
                    }
                    path.push(name.to_string());
                    colons = 0;
                }
                other => {
                    self.add_path(std::mem::take(&mut path));
                    colons = 0;
                    if let TokenTree::Group(group) = other {
                        self.add_tokens(group.stream());
                    }
                }
            }
        }
        self.add_path(path);
    }
}

/// Whether one of these attributes compiles an item for tests only.
fn is_for_tests(attributes: &[syn::Attribute]) -> bool {
    attributes.iter().any(|attribute| match &attribute.meta {
        syn::Meta::List(list) if list.path.is_ident("cfg") => {
            let words: Vec<_> = list.tokens.clone().into_iter().map(|token| token.to_string()).collect();
            words[0] == "test" || words[0] == "all" && words[1].trim_start_matches('(').starts_with("test")
        }
        _ => false,
    })
}

fn attributes(item: &syn::Item) -> &[syn::Attribute] {
    match item {
        syn::Item::Const(item) => &item.attrs,
        syn::Item::Fn(item) => &item.attrs,
        syn::Item::Impl(item) => &item.attrs,
        syn::Item::Mod(item) => &item.attrs,
        syn::Item::Static(item) => &item.attrs,
        syn::Item::Struct(item) => &item.attrs,
        syn::Item::Use(item) => &item.attrs,
        _ => &[],
    }
}

impl Visit<'_> for Source {
    fn visit_item(&mut self, item: &syn::Item) {
        let is_for_tests = usize::from(is_for_tests(attributes(item)));
        self.in_tests += is_for_tests;
        let name = match item {
            syn::Item::Enum(item) => Some(&item.ident),
            syn::Item::Struct(item) => Some(&item.ident),
            syn::Item::Trait(item) => Some(&item.ident),
            syn::Item::Type(item) => Some(&item.ident),
            _ => None,
        };
        if self.in_tests == 0 {
            self.types.extend(name.map(ToString::to_string));
        }
        visit::visit_item(self, item);
        self.in_tests -= is_for_tests;
    }

    fn visit_item_use(&mut self, item: &syn::ItemUse) {
        if self.in_tests == 0 {
            self.add_imports(&[], &item.tree);
        }
    }

    fn visit_path(&mut self, path: &syn::Path) {
        self.add_path(path.segments.iter().map(|segment| segment.ident.to_string()).collect());
        visit::visit_path(self, path);
    }

    fn visit_visibility(&mut self, _: &syn::Visibility) {}

    fn visit_macro(&mut self, called: &syn::Macro) {
        self.add_tokens(called.tokens.clone());
        visit::visit_macro(self, called);
    }

    fn visit_item_fn(&mut self, function: &syn::ItemFn) {
        self.add_function(&function.sig, Some(&function.block));
        visit::visit_item_fn(self, function);
    }

    fn visit_impl_item_fn(&mut self, function: &syn::ImplItemFn) {
        self.add_function(&function.sig, Some(&function.block));
        visit::visit_impl_item_fn(self, function);
    }
    fn visit_trait_item_fn(&mut self, function: &syn::TraitItemFn) {
        self.add_function(&function.sig, function.default.as_ref());
        visit::visit_trait_item_fn(self, function);
    }

    fn visit_item_impl(&mut self, item: &syn::ItemImpl) {
        let outer = std::mem::replace(&mut self.in_trait, item.trait_.is_some());
        visit::visit_item_impl(self, item);
        self.in_trait = outer;
    }
}
