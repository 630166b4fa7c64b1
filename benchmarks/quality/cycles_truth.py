"""Renders the true scene of a synthetic capture again, with the renderer that its pictures came from
(Blender 3.4 Cycles, Debian's `blender`) by brute force: what noise those pictures have, and whether
an error against them is ours. Runs inside Blender:

    blender -b --factory-startup -P benchmarks/quality/cycles_truth.py -- CAPTURE --frame 2 \
        --insert insert --window 300 100 120 80 --samples 4096 --seeds 0 1 2 3 --out FOLDER

Writes FOLDER/seed_K/ID.exr and, with --insert, FOLDER/seed_K/ID_with.exr: the whole picture, linear,
32-bit, alpha 0 outside of the window. Files that exist are kept, so more seeds can be added.
`vitrine_render_quality CAPTURE --truth FOLDER` averages the seeds. Nothing is filtered, clamped or
denoised; paths end by roulette or after 64 bounces. Cost: W * H * samples * seeds paths, 0.2 to 0.5 M
paths per CPU second.
"""
import argparse
import json
import math
import os
import sys

import bpy
import numpy as np
from mathutils import Matrix, Vector

TABLE_SIZE_M = 1.2  # of the albedo texture, see the note in scene.json


class Nodes:
    """A material's or the world's shader, built of few nodes."""

    def __init__(self, owner):
        owner.use_nodes = True
        self.tree = owner.node_tree
        self.tree.nodes.clear()

    def add(self, kind, **inputs):
        node = self.tree.nodes.new("ShaderNode" + kind)
        for name, value in inputs.items():
            socket = node.inputs[name]
            if isinstance(value, bpy.types.NodeSocket):
                self.tree.links.new(value, socket)
            else:
                socket.default_value = value
        return node


def rgba(colour):
    return (*colour, 1.0)


def lambert(nodes, material, folder):
    if "albedo_texture" not in material:
        return nodes.add("BsdfDiffuse", Color=rgba(material["albedo"])).outputs[0]
    position = nodes.add("NewGeometry").outputs["Position"]
    place = nodes.add("Mapping", Vector=position, Scale=(1 / TABLE_SIZE_M,) * 3,
                      Location=(0.5, 0.5, 0.0))
    texture = nodes.add("TexImage", Vector=place.outputs[0])
    texture.image = bpy.data.images.load(os.path.join(folder, material["albedo_texture"]))
    texture.image.colorspace_settings.name = "Non-Color"
    texture.interpolation = "Linear"
    return nodes.add("BsdfDiffuse", Color=texture.outputs[0]).outputs[0]


def make_material(name, material, folder):
    made = bpy.data.materials.new(name)
    nodes = Nodes(made)
    if material["type"] == "lambert":
        nodes.add("OutputMaterial", Surface=lambert(nodes, material, folder))
    elif material["type"].startswith("smooth dielectric"):
        glass = nodes.add("BsdfGlass", Color=rgba([1, 1, 1]), IOR=material["ior"])
        glass.distribution = "SHARP"
        sockets = {"Surface": glass.outputs[0]}
        sigma = np.array(material["sigma_a_per_metre"], float)
        if sigma.max() > 0:
            absorption = nodes.add("VolumeAbsorption", Density=sigma.max(),
                                   Color=rgba(1 - sigma / sigma.max()))
            sockets["Volume"] = absorption.outputs[0]
        nodes.add("OutputMaterial", **sockets)
    else:
        diffuse = nodes.add("BsdfDiffuse", Color=rgba(material["rho_d"]))
        glossy = nodes.add("BsdfGlossy", Color=rgba(material["rho_s"]),
                           Roughness=material["cycles_roughness"])
        glossy.distribution = "BECKMANN"
        both = nodes.add("AddShader")
        nodes.tree.links.new(diffuse.outputs[0], both.inputs[0])
        nodes.tree.links.new(glossy.outputs[0], both.inputs[1])
        nodes.add("OutputMaterial", Surface=both.outputs[0])
    return made


def add_mesh(name, vertices, faces, material):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices, [], faces)
    mesh.materials.append(material)
    made = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(made)


def read_ply(path):
    """Vertices and triangles of a binary PLY with x, y, z alone."""
    with open(path, "rb") as file:
        header = [file.readline().split()]
        while header[-1] != [b"end_header"]:
            header.append(file.readline().split())
        counts = [int(line[2]) for line in header if line[0] == b"element"]
        fields = [line[-1] for line in header if line[0] == b"property"]
        if fields != [b"x", b"y", b"z", b"vertex_indices"]:
            sys.exit(f"{path}: expected vertices of x, y, z and faces, found {fields}")
        vertices = np.fromfile(file, "<f4", 3 * counts[0]).reshape(-1, 3)
        faces = np.fromfile(file, np.dtype([("n", "u1"), ("v", "<i4", 3)]), counts[1])
    return vertices.tolist(), faces["v"].tolist()


def read_obj(path):
    vertices, faces = [], []
    with open(path) as file:
        for line in file:
            word = line.split()
            if word[:1] == ["v"]:
                vertices.append([float(x) for x in word[1:4]])
            elif word[:1] == ["f"]:
                faces.append([int(x.split("/")[0]) - 1 for x in word[1:]])
    return vertices, faces


def add_lamp(light, is_sampled):
    """The one-sided disc as the 64-gon that the truth has.

    is_sampled: also by shadow rays; else only paths that happen on it bring its light."""
    centre, normal = Vector(light["centre"]), Vector(light["normal"]).normalized()
    side = normal.orthogonal().normalized()
    up = normal.cross(side)
    angles = [2 * math.pi * k / 64 for k in range(64)]
    ring = [centre + light["radius"] * (math.cos(a) * side + math.sin(a) * up) for a in angles]
    made = bpy.data.materials.new("lamp")
    made.cycles.sample_as_light = is_sampled
    nodes = Nodes(made)
    radiance = np.array(light["radiance_W_m2_sr"])
    emission = nodes.add("Emission", Color=rgba(radiance / radiance.max()),
                         Strength=radiance.max())
    sides = nodes.add("MixShader", Fac=nodes.add("NewGeometry").outputs["Backfacing"])
    nodes.tree.links.new(emission.outputs[0], sides.inputs[1])
    nodes.add("OutputMaterial", Surface=sides.outputs[0])
    add_mesh("lamp", ring, [list(range(64))], made)


def make_scene(truth, folder, samples_lamps):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    for light in truth["lights"]:
        add_lamp(light, samples_lamps)
    for item in truth["objects"]:
        vertices, faces = read_ply(os.path.join(folder, item["mesh"]))
        add_mesh(item["name"], vertices, faces, make_material(item["name"], item["material"], folder))
    scene.world = bpy.data.worlds.new("ambient")
    nodes = Nodes(scene.world)
    background = nodes.add("Background", Color=rgba([truth["ambient"]["radiance_W_m2_sr"]] * 3))
    nodes.add("OutputWorld", Surface=background.outputs[0])
    return scene


def set_camera(scene, intrinsics, pose):
    width, height = intrinsics["width"], intrinsics["height"]
    data = bpy.data.cameras.new("camera")
    data.sensor_fit, data.sensor_width = "HORIZONTAL", 36.0
    data.lens = intrinsics["fx"] * data.sensor_width / width
    data.shift_x = ((width - 1) / 2 - intrinsics["cx"]) / width
    data.shift_y = (intrinsics["cy"] - (height - 1) / 2) / width
    data.clip_start = 0.01
    scene.camera = bpy.data.objects.new("camera", data)
    scene.camera.matrix_world = Matrix(pose) @ Matrix.Diagonal((1, -1, -1, 1))
    scene.collection.objects.link(scene.camera)
    render = scene.render
    render.resolution_x, render.resolution_y, render.resolution_percentage = width, height, 100


def set_window(render, window):
    x, y, width, height = window
    render.use_border, render.use_crop_to_border = True, False
    render.border_min_x = (x + 0.01) / render.resolution_x
    render.border_max_x = (x + width + 0.01) / render.resolution_x
    render.border_min_y = 1 - (y + height - 0.01) / render.resolution_y
    render.border_max_y = 1 - (y - 0.01) / render.resolution_y


def set_sampling(scene, samples):
    scene.render.engine = "CYCLES"
    cycles = scene.cycles
    cycles.samples = samples
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.sampling_pattern = "SOBOL"
    cycles.pixel_filter_type = "BOX"
    cycles.filter_width = 1.0
    cycles.light_sampling_threshold = 0
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0
    cycles.blur_glossy = 0
    cycles.caustics_reflective = cycles.caustics_refractive = True
    cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = 64
    cycles.transmission_bounces = cycles.transparent_max_bounces = 64
    scene.render.threads_mode, scene.render.threads = "FIXED", len(os.sched_getaffinity(0))
    image = scene.render.image_settings
    image.file_format, image.color_mode = "OPEN_EXR", "RGBA"
    image.color_depth, image.exr_codec = "32", "ZIP"


def main():
    parser = argparse.ArgumentParser(prog="cycles_truth.py", description=__doc__.split("\n\n")[0])
    parser.add_argument("capture")
    parser.add_argument("--frame", type=int, required=True)
    parser.add_argument("--insert", help="folder below truth/ that has the virtual object")
    parser.add_argument("--window", type=int, nargs=4, metavar=("X", "Y", "W", "H"))
    parser.add_argument("--samples", type=int, default=1024, help="paths a pixel and seed")
    parser.add_argument("--seeds", type=int, nargs="+", default=[0, 1])
    parser.add_argument("--by-chance", action="store_true",
                        help="no shadow rays to the lamps: the same picture with far more noise")
    parser.add_argument("--out", required=True)
    options = parser.parse_args(sys.argv[sys.argv.index("--") + 1:])

    folder = os.path.join(os.path.abspath(options.capture), "truth")
    with open(os.path.join(folder, "scene.json")) as file:
        truth = json.load(file)
    scene = make_scene(truth, folder, not options.by_chance)
    view = next(v for v in truth["views"] if v["index"] == options.frame)
    set_camera(scene, truth["camera"], view["camera_to_world"])
    set_sampling(scene, options.samples)
    if options.window:
        set_window(scene.render, options.window)

    def render(suffix):
        for seed in options.seeds:
            name = f"seed_{seed}/{options.frame:06d}{suffix}.exr"
            path = os.path.join(os.path.abspath(options.out), name)
            if os.path.exists(path):
                continue
            scene.cycles.seed = seed
            scene.render.filepath = path
            bpy.ops.render.render(write_still=True)

    render("")
    if options.insert:
        inserted = os.path.join(folder, options.insert)
        with open(os.path.join(inserted, "insert.json")) as file:
            insert = json.load(file)
        vertices, faces = read_obj(os.path.join(inserted, insert["object"]))
        add_mesh("virtual", vertices, faces, make_material("virtual", insert["material"], inserted))
        render("_with")


main()
