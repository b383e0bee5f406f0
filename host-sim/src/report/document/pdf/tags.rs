//! The structure of the PDF: headings, paragraphs, lists, tables with their cells, pictures with
//! their words. Programs that read aloud, or that show the text in another form, follow it.

use pdf_writer::types::{StructRole, TableHeaderScope};
use pdf_writer::{Content, Finish, Name, Pdf, Ref, TextStr};

/// The elements so far, and where in them the next text belongs.
#[derive(Debug)]
pub(super) struct Tags {
    /// The first is the document.
    elements: Vec<Element>,
    open: Vec<usize>,
    /// The element of each marked piece, by its number on its page.
    marks: Vec<Vec<usize>>,
}

#[derive(Debug)]
struct Element {
    role: StructRole,
    parent: usize,
    /// What stands for a picture in words.
    alt: Option<String>,
    children: Vec<Child>,
}

#[derive(Debug, Clone, Copy)]
enum Child {
    Element(usize),
    /// Page, and number on it.
    Mark(usize, i32),
}

/// The page and the area of an element that leads somewhere.
pub(super) type Linked = (usize, Ref, Ref);

impl Tags {
    pub fn new() -> Self {
        let document = Element {
            role: StructRole::Document,
            parent: 0,
            alt: None,
            children: vec![],
        };
        Self {
            elements: vec![document],
            open: vec![0],
            marks: vec![],
        }
    }

    /// The element that the next text belongs to.
    fn now(&self) -> usize {
        self.open.last().copied().unwrap_or(0)
    }

    /// Begins an element within the present one, and gives its number.
    pub fn open(&mut self, role: StructRole, alt: Option<&str>) -> usize {
        let (number, parent) = (self.elements.len(), self.now());
        self.elements.push(Element {
            role,
            parent,
            alt: alt.map(str::to_owned),
            children: vec![],
        });
        self.elements[parent].children.push(Child::Element(number));
        self.open.push(number);
        number
    }

    /// Ends the present element.
    pub fn close(&mut self) {
        if self.open.len() > 1 {
            self.open.pop();
        }
    }

    /// What is drawn from here to the end of the mark belongs to the present element.
    pub fn begin(&mut self, page: usize, content: &mut Content) {
        let element = self.now();
        while self.marks.len() <= page {
            self.marks.push(vec![]);
        }
        let number = self.marks[page].len() as i32;
        self.marks[page].push(element);
        self.elements[element]
            .children
            .push(Child::Mark(page, number));
        content
            .begin_marked_content_with_properties(tag(self.elements[element].role))
            .properties()
            .identify(number);
    }

    /// Writes the elements. `pages` are the pages, `links` the elements of links with their pages
    /// and annotations, and `root` is for the tree of what stands where. Gives the element of the
    /// whole document.
    pub fn write(
        &self,
        pdf: &mut Pdf,
        (root, parents): (Ref, Ref),
        pages: &[Ref],
        links: &[Linked],
        next: &mut impl FnMut() -> Ref,
    ) -> Ref {
        let ids: Vec<Ref> = self.elements.iter().map(|_| next()).collect();
        for (number, (element, id)) in self.elements.iter().zip(&ids).enumerate() {
            let mut of = pdf.struct_element(*id);
            of.kind(element.role);
            of.parent(if number == 0 {
                root
            } else {
                ids[element.parent]
            });
            if let Some(alt) = &element.alt {
                of.alt(TextStr(alt));
            }
            if matches!(element.role, StructRole::TH) {
                of.attributes()
                    .push()
                    .table()
                    .scope(TableHeaderScope::Column);
            }
            let mut children = of.children();
            for child in &element.children {
                match child {
                    Child::Element(child) => {
                        children.struct_element(ids[*child]);
                    }
                    Child::Mark(page, mark) => {
                        children
                            .marked_content_ref()
                            .page(pages[*page])
                            .marked_content_id(*mark);
                    }
                }
            }
            for (_, page, annotation) in links.iter().filter(|(of, ..)| *of == number) {
                children.object_ref().page(*page).object(*annotation);
            }
            children.finish();
        }
        let lists: Vec<Ref> = self.marks.iter().map(|_| next()).collect();
        for (marks, id) in self.marks.iter().zip(&lists) {
            let mut list = pdf.indirect(*id).array();
            list.items(marks.iter().map(|element| ids[*element]));
        }
        let mut tree = pdf.number_tree::<Ref>(parents);
        let mut entries = tree.nums();
        for (page, list) in lists.iter().enumerate() {
            entries.insert(page as i32, *list);
        }
        for (k, (element, ..)) in links.iter().enumerate() {
            entries.insert(key(pages.len(), k), ids[*element]);
        }
        entries.finish();
        tree.finish();
        ids[0]
    }
}

/// The key of a link in the tree of what stands where, after those of the pages.
pub(super) fn key(pages: usize, link: usize) -> i32 {
    (pages + link) as i32
}

/// Draws what is no content: lines, the feet of pages, marks before the items of a list.
pub(super) fn artifact(content: &mut Content) {
    content.begin_marked_content(Name(b"Artifact"));
}

/// The name of a role in the content of a page.
fn tag(role: StructRole) -> Name<'static> {
    Name(match role {
        StructRole::H1 => b"H1",
        StructRole::H2 => b"H2",
        StructRole::LBody => b"LBody",
        StructRole::TH => b"TH",
        StructRole::TD => b"TD",
        StructRole::Figure => b"Figure",
        StructRole::Caption => b"Caption",
        StructRole::Link => b"Link",
        StructRole::Code => b"Code",
        _ => b"P",
    })
}
