//! Pictures of the world: surfels on the bodies, new skin in cuts, tools and blades.

mod coloring;
mod error;
mod inspect;
mod knife;
mod markers;
mod surfels;
mod textured;
mod tool;

pub use error::{PictureError, SkinProblem};
pub use surfels::surfels_on_solid;

use std::io::Cursor;
use std::path::Path;
use std::sync::Arc;

use phyxel_discretize::Bounds;
use phyxel_splat::{
    Background, Camera, DrawnMesh, DrawnTissue, Frame, Image, ImageCoat, MergedSplats, Overlay,
    RenderSettings, Renderer, Surface, Tissue, TissueSettings, TissueTexture, linear_color,
};

use phyxel_scene::read_file;

use phyxel::scene::{self, Coloring, Pictures, Show, SurfelSettings};
use phyxel::{Body, CutPiece, World, ask_memory};

/// Bytes of a sample of a pixel: colour, depth, normal, and what encoding takes.
const SAMPLED_PIXEL: f64 = 32.0;

/// Draws the world as a scene asks.
#[derive(Debug)]
pub struct Painter {
    skins: Vec<DrawnTissue>,
    renderer: Renderer,
    camera: Camera,
    coloring: Coloring,
    splat_scale: f64,
    show: Show,
    /// Rigid surfaces of the scene, and the looks of each tool in its own frame.
    rigid: Vec<DrawnMesh>,
    looks: Vec<Option<DrawnMesh>>,
    frames: usize,
}

impl Painter {
    /// Covers the bodies with surfels and sets the camera up.
    ///
    /// # Errors
    /// [`PictureError`] if a surface cannot be sampled or bound to its nodes, or an image or a mesh cannot be read.
    pub fn new(world: &World, pictures: &Pictures) -> Result<Self, PictureError> {
        let scene = world.scene();
        let pixels = f64::from(pictures.width) * f64::from(pictures.height);
        ask_memory(SAMPLED_PIXEL * pixels * f64::from(pictures.samples).powi(2))?;
        let skins = world
            .bodies()
            .iter()
            .zip(&scene.bodies)
            .zip(surfels::shares(world))
            .map(|((body, description), share)| {
                skin_of(body, description, share)
                    .map_err(|problem| problem.named(&description.name))
            })
            .collect::<Result<Vec<_>, _>>()?;
        let Bounds { min, max } = bounds_of(world);
        let aspect = f64::from(pictures.width) / f64::from(pictures.height);
        let camera = pictures.view.camera(min, max, aspect);
        let background = pictures.background.map(|behind| Background {
            top: linear_color(behind.top),
            bottom: linear_color(behind.bottom),
        });
        let surfaces = skins.iter().flat_map(|skin| skin.surfaces.iter().cloned());
        let plain = Surface {
            specular: 0.0,
            ..Surface::default()
        };
        let colored = pictures.color != Coloring::Tissue;
        let surfaces = surfaces.map(|own| if colored { plain.clone() } else { own });
        let images = skins.iter().flat_map(|skin| skin.images.iter().cloned());
        let images = images.filter(|_| !colored).collect();
        let rigid = pictures
            .meshes
            .iter()
            .map(|mesh| tool::read_rigid(mesh, 1.0));
        let rigid = rigid.collect::<Result<Vec<_>, _>>()?;
        let looks = scene.tools.iter().map(|tool| {
            let looks = tool.looks.as_ref();
            looks
                .map(|mesh| tool::read_rigid(mesh, tool.scale))
                .transpose()
        });
        let looks = looks.collect::<Result<Vec<_>, _>>()?;
        let renderer = Renderer::new(RenderSettings {
            width: pictures.width,
            height: pictures.height,
            samples: pictures.samples,
            background: background.unwrap_or_default(),
            mode: pictures.mode,
            surfaces: surfaces.collect(),
            images,
            ..RenderSettings::default()
        });
        Ok(Self {
            skins,
            renderer,
            camera,
            coloring: pictures.color,
            splat_scale: pictures.splat_scale,
            show: pictures.show,
            rigid,
            looks,
            frames: 0,
        })
    }

    /// The surfaces of all bodies, those of cuts included, where [`Painter::carry`] has moved them.
    #[must_use]
    pub fn skins(&self) -> &[DrawnTissue] {
        &self.skins
    }

    /// The settings of the renderer.
    #[must_use]
    pub fn settings(&self) -> &RenderSettings {
        self.renderer.settings()
    }

    /// Draws from another position, in another size.
    ///
    /// # Panics
    /// If the size is none that [`Renderer::new`] takes.
    pub fn look(&mut self, camera: Camera, [width, height]: [u32; 2]) {
        self.camera = camera;
        self.renderer = Renderer::new(RenderSettings {
            width,
            height,
            ..self.renderer.settings().clone()
        });
    }

    /// Heap bytes of the surfels, as they are and as they are drawn.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.skins.iter().map(DrawnTissue::bytes).sum()
    }

    /// A copy of the surfaces, without what the next picture computes again.
    #[must_use]
    pub fn surfaces(&self) -> Vec<DrawnTissue> {
        self.skins.iter().map(DrawnTissue::unmoved).collect()
    }

    /// Goes back to surfaces that [`Painter::surfaces`] gave.
    pub fn set_surfaces(&mut self, surfaces: Vec<DrawnTissue>) {
        self.skins = surfaces;
    }

    /// Number of frames drawn.
    pub(crate) fn frames(&self) -> usize {
        self.frames
    }

    /// Counts frames from `frames` on, as a resumed run does.
    pub(crate) fn set_frames(&mut self, frames: usize) {
        self.frames = frames;
    }

    /// Surfels of the outer surfaces, and all others: new skin and split surfels.
    #[must_use]
    pub fn surfel_counts(&self) -> (usize, usize) {
        let outer = self.skins.iter().map(|s| s.tissue.outer_count()).sum();
        let all: usize = self.skins.iter().map(|s| s.tissue.surfels().len()).sum();
        (outer, all - outer)
    }

    /// Grows new skin on new pieces of cuts; the surfels of each body that may be other than before.
    ///
    /// # Errors
    /// [`PictureError`] if a piece is not finite.
    pub fn grow(
        &mut self,
        world: &World,
        pieces: &[CutPiece],
    ) -> Result<Vec<Vec<u32>>, PictureError> {
        let mut changed = vec![Vec::new(); self.skins.len()];
        for piece in pieces {
            let body = &world.bodies()[piece.body];
            let tissue = &mut self.skins[piece.body].tissue;
            let cut = body.cut_surface(tissue, &piece.triangles);
            let cut = cut.map_err(|problem| SkinProblem::from(problem).named(&body.name))?;
            changed[piece.body].extend(cut);
        }
        for ((skin, body), changed) in self.skins.iter_mut().zip(world.bodies()).zip(&mut changed) {
            if !changed.is_empty() {
                changed.extend(skin.tissue.part(&body.pieces().piece));
            }
        }
        Ok(changed)
    }

    /// Moves the surfels to where the bodies are.
    pub fn carry(&mut self, world: &World) {
        for (skin, body) in self.skins.iter_mut().zip(world.bodies()) {
            let gradients = body.elastic().deformation_gradients();
            skin.carry(&body.smoothed_positions(), &gradients);
            if let Some((scale, _)) = coloring::legend(self.coloring) {
                skin.colors = coloring::colors(self.coloring, &scale, skin, body);
            }
        }
    }

    /// Draws one frame of what [`Painter::carry`] has moved.
    pub fn draw(&mut self, world: &World) -> Frame {
        self.frames += 1;
        let mut meshes = if self.show != Show::Surface {
            Vec::new()
        } else {
            let mut meshes = tool::meshes(world, &self.looks);
            meshes.extend(self.rigid.iter().cloned());
            meshes
        };
        for (skin, body) in self.skins.iter().zip(world.bodies()) {
            meshes.extend(inspect::meshes(self.show, body, skin));
        }
        if self.show == Show::BladePath {
            meshes.extend(inspect::blade_paths(world));
        }
        let camera = if self.show == Show::Lattice {
            let RenderSettings { width, height, .. } = self.renderer.settings();
            let aspect = f64::from(*width) / f64::from(*height);
            inspect::outside_of(&meshes, self.camera, aspect)
        } else {
            self.camera
        };
        let mut frame = match &self.skins[..] {
            [only] if self.splat_scale >= 1.0 && inspect::has_surface(self.show) => {
                self.renderer.draw(&only.view(), &meshes, &camera)
            }
            skins => {
                let shown = skins.iter().filter(|_| inspect::has_surface(self.show));
                let mut all = MergedSplats::of(
                    shown.map(|skin| (skin.view(), skin.surfaces.len(), skin.images.len())),
                );
                all.scale(self.splat_scale);
                self.renderer.draw(&all.view(), &meshes, &camera)
            }
        };
        let legends = [coloring::legend(self.coloring), inspect::legend(self.show)];
        if let Some((scale, title)) = legends.into_iter().flatten().next() {
            Overlay::new(&mut frame).legend(&scale, title);
        }
        frame
    }
}

/// The surface of one body.
fn skin_of(body: &Body, description: &scene::Body, share: f64) -> Result<DrawnTissue, SkinProblem> {
    let spec = &description.surfels;
    let surfels = match &spec.points {
        Some(points) => surfels::scanned(points, description, body)?,
        None => surfels::spread(spec.target, spec.spacing, share, body)?,
    };
    if let Some(density) = spec.cut_density {
        // A blade that goes through makes two faces, each about as large as half of the surface.
        surfels::allowed("cut_density", density, surfels.areas.iter().sum())?;
    }
    let tissue = Tissue::new(
        &surfels.positions,
        &surfels.normals,
        &surfels.areas,
        &body.rest,
        &TissueSettings {
            skin_density: spec.cut_density,
            ..tissue_of(spec)
        },
    )?;
    let [color, cut_color] = [spec.color, spec.cut_color].map(linear_color);
    let size = body.solid.bounds().size().max_element();
    let texture = TissueTexture::in_colors(color, cut_color, size);
    let mut surfaces = texture.surfaces();
    for (surface, image) in surfaces.iter_mut().zip([&spec.image, &spec.cut_image]) {
        if let Some(image) = image {
            let (size, image) = (image.size, Arc::new(image_of(&image.file)?));
            surface.coat = Some(ImageCoat { image, size });
        }
    }
    let mut skin = DrawnTissue::new(tissue, texture, surfaces);
    if spec.textured {
        textured::lay(description, &mut skin)?;
    }
    Ok(skin)
}

/// Radii, clipping and binding of a body's surfels as a scene wants them.
fn tissue_of(spec: &SurfelSettings) -> TissueSettings {
    TissueSettings {
        neighbors: spec.nodes as usize,
        weights: spec.weights,
        radius: spec.radius,
        opening: spec.opening,
        clip: spec.clip,
        inside: spec.inside,
        ..TissueSettings::default()
    }
}

/// The box around all bodies at rest.
pub(crate) fn bounds_of(world: &World) -> Bounds {
    let boxes = world.bodies().iter().map(|body| body.solid.bounds());
    Bounds::of(boxes.flat_map(|bounds| [bounds.min, bounds.max]))
}

/// The image of a file.
fn image_of(file: &Path) -> Result<Image, SkinProblem> {
    let problem = |source| SkinProblem::Image {
        file: file.to_owned(),
        source,
    };
    let bytes = read_file(file).map_err(|error| problem(error.into()))?;
    Image::read_png(Cursor::new(bytes)).map_err(problem)
}
