"""Renders a job of `blender.py` by Blender's Cycles: `python cycles_render.py job.json`.

A process of its own, since `bpy` wants a Python of one version. It needs `bpy` and nothing else. Writes
the pictures as EXR files and `answer.json` to the folder that the job names. Blender looks for its add-ons beside
this file first: no module here may be called `cycles`.
"""

import json
import math
import os
import sys
import time
from array import array
from pathlib import Path

import bpy
from mathutils import Matrix, Vector


def main() -> None:
    job = json.loads(Path(sys.argv[1]).read_text())
    scene = empty_scene()
    devices = choose_device(scene, job["device"])
    settings(scene, job)
    camera(scene, job["camera"])
    world(scene, job["environment"])
    materials = [material(str(number), spec) for number, spec in enumerate(job["materials"])]
    for number, spec in enumerate(job["meshes"]):
        mesh(scene, str(number), spec, materials[spec["material"]])
    for number, spec in enumerate(job["lights"]):
        light(scene, str(number), spec)
    answer = {"version": bpy.app.version_string, "devices": devices, "times": render_all(scene, job)}
    (Path(job["folder"]) / "answer.json").write_text(json.dumps(answer))
    # What Blender does at the end is of no use here.
    sys.stdout.flush()
    os._exit(0)


def empty_scene() -> bpy.types.Scene:
    data = bpy.data
    for kind in (data.objects, data.meshes, data.materials, data.lights, data.cameras, data.worlds):
        for block in list(kind):
            kind.remove(block)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    return scene


def choose_device(scene: bpy.types.Scene, kind: str) -> list[str]:
    """Has Cycles use all devices of a kind, such as CUDA or OPTIX, or the processor; gives their names."""
    if kind == "CPU":
        return ["CPU"]
    preferences = bpy.context.preferences.addons["cycles"].preferences
    preferences.compute_device_type = kind
    found = preferences.get_devices_for_type(kind) or []
    for device in found:
        device.use = device.type == kind
    used = [device.name for device in found if device.use]
    if not used:
        sys.exit(f"Cycles finds no device for {kind}")
    scene.cycles.device = "GPU"
    return used


def settings(scene: bpy.types.Scene, job: dict) -> None:
    """Everything that biases the picture is off, and so is all that makes renders differ in work."""
    render, cycles = scene.render, scene.cycles
    render.resolution_x, render.resolution_y = job["size"]
    render.resolution_percentage = 100
    render.use_persistent_data = True
    render.use_compositing = render.use_sequencer = False
    bounces = job["max_bounces"]
    values = {
        "use_adaptive_sampling": False,
        "use_denoising": False,
        "use_guiding": False,
        "use_fast_gi": False,
        "use_auto_tile": False,
        "use_light_tree": False,
        "time_limit": 0.0,
        "sample_clamp_direct": 0.0,
        "sample_clamp_indirect": 0.0,
        "light_sampling_threshold": 0.0,
        "blur_glossy": 0.0,
        "min_light_bounces": 0,
        "caustics_reflective": True,
        "caustics_refractive": True,
        "max_bounces": bounces,
        "diffuse_bounces": bounces,
        "glossy_bounces": bounces,
        "transmission_bounces": bounces,
        "transparent_max_bounces": bounces,
        "pixel_filter_type": "BOX",
        "filter_width": 1.0,
    }
    for name, value in (values | job["options"]).items():
        setattr(cycles, name, value)
    image = render.image_settings
    image.file_format, image.color_mode, image.color_depth, image.exr_codec = "OPEN_EXR", "RGB", "32", "ZIP"


def camera(scene: bpy.types.Scene, spec: dict) -> None:
    data = bpy.data.cameras.new("camera")
    data.sensor_fit = "VERTICAL"
    data.angle_y = math.radians(spec["fov"])
    position, target = Vector(spec["position"]), Vector(spec["look_at"])
    data.clip_start, data.clip_end = 1e-4 * (target - position).length, 1e5 * (target - position).length
    if spec["aperture"] > 0:
        data.dof.use_dof = True
        data.dof.focus_distance = spec["focus"]
        # The lens is in millimetres.
        data.dof.aperture_fstop = 1e-3 * data.lens / spec["aperture"]
    back = (position - target).normalized()
    right = Vector(spec["up"]).cross(back).normalized()
    scene.camera = place(scene, data, position, right, back)


def place(scene: bpy.types.Scene, data: bpy.types.ID, position: Vector, x: Vector, z: Vector) -> bpy.types.Object:
    """An object at a place, by two of its axes."""
    thing = bpy.data.objects.new(data.name, data)
    scene.collection.objects.link(thing)
    columns = [*(axis.to_4d() for axis in (x, z.cross(x), z)), position.to_4d()]
    matrix = Matrix(columns).transposed()
    matrix[3] = (0.0, 0.0, 0.0, 1.0)
    thing.matrix_world = matrix
    return thing


# ---- Light ---------------------------------------------------------------------------------------


def light(scene: bpy.types.Scene, name: str, spec: dict) -> None:
    data = bpy.data.lights.new(name, spec["kind"])
    z = Vector(spec["z"])
    if spec["kind"] == "SUN":
        data.energy, data.color = strength_and_color(spec["irradiance"])
        data.angle = math.radians(spec["angle"])
        x, center = z.orthogonal().normalized(), Vector()
    else:
        radiance, data.color = strength_and_color(spec["radiance"])
        data.shape, (data.size, data.size_y) = "RECTANGLE", spec["size"]
        # Watts into the half space in front.
        data.energy = math.pi * data.size * data.size_y * radiance
        x, center = Vector(spec["x"]), Vector(spec["center"])
        place(scene, rectangle(name, spec["size"]), center, x, z)
        center = center - spec["gap"] * z
    # Lamps hide from the camera unless told otherwise.
    place(scene, data, center, x, z).visible_camera = True


def rectangle(name: str, size: list[float]) -> bpy.types.Mesh:
    """One that is black on both sides."""
    data = bpy.data.meshes.new(name)
    x, y = (0.5 * side for side in size)
    data.from_pydata([(-x, -y, 0.0), (x, -y, 0.0), (x, y, 0.0), (-x, y, 0.0)], [], [(0, 1, 2, 3)])
    data.materials.append(material(name, {"nodes": [], "emission": None}))
    return data


def strength_and_color(value: list[float]) -> tuple[float, list[float]]:
    strength = max(value)
    return strength, [x / strength if strength > 0 else 0.0 for x in value]


def world(scene: bpy.types.Scene, spec: dict | None) -> None:
    data = bpy.data.worlds.new("world")
    scene.world = data
    tree = data.node_tree
    tree.nodes.clear()
    background, output = tree.nodes.new("ShaderNodeBackground"), tree.nodes.new("ShaderNodeOutputWorld")
    tree.links.new(background.outputs[0], output.inputs["Surface"])
    if spec is None:
        background.inputs["Strength"].default_value = 0.0
        return
    data.cycles.sampling_method = "AUTOMATIC" if spec["sample"] else "NONE"
    scale = spec["scale"]
    if "color" in spec:
        value = [x * y for x, y in zip(spec["color"], scale, strict=True)]
        strength, color = strength_and_color(value)
        background.inputs["Color"].default_value = [*color, 1.0]
        background.inputs["Strength"].default_value = strength
        return
    if max(scale) - min(scale) > 1e-6 * max(scale):
        sys.exit("colored scales of environment maps are not taken over")
    background.inputs["Strength"].default_value = scale[0]
    picture = tree.nodes.new("ShaderNodeTexEnvironment")
    picture.image = bpy.data.images.load(spec["file"])
    picture.image.colorspace_settings.name = "Non-Color"
    # In the middle of Impasto's pictures is -z, and up is y. In that of Blender's is x, and up is z.
    axes = Matrix(((0, 0, -1), (-1, 0, 0), (0, 1, 0))) @ Matrix.Rotation(math.radians(-spec["rotate"]), 3, "Y")
    mapping, coordinates = tree.nodes.new("ShaderNodeMapping"), tree.nodes.new("ShaderNodeTexCoord")
    mapping.inputs["Rotation"].default_value = axes.to_euler("XYZ")
    tree.links.new(coordinates.outputs["Generated"], mapping.inputs["Vector"])
    tree.links.new(mapping.outputs["Vector"], picture.inputs["Vector"])
    tree.links.new(picture.outputs["Color"], background.inputs["Color"])


# ---- Surfaces ------------------------------------------------------------------------------------


def material(name: str, spec: dict) -> bpy.types.Material:
    out = bpy.data.materials.new(name)
    tree = out.node_tree
    tree.nodes.clear()
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    surface, covered = None, 0.0
    for node in spec["nodes"]:
        one = bsdf(tree, node, spec["picture"])
        share = node.get("share", 1.0)
        covered += share
        surface = one if surface is None else mixed(tree, surface, one, share / covered)
    if spec["emission"] is not None:
        # Impasto's lamps shine to their front, so there is no use in samples for the back.
        out.cycles.emission_sampling = "FRONT"
        strength, color = strength_and_color(spec["emission"])
        emission = tree.nodes.new("ShaderNodeEmission")
        emission.inputs["Color"].default_value = [*color, 1.0]
        emission.inputs["Strength"].default_value = strength
        surface = emission.outputs[0] if surface is None else added(tree, surface, emission.outputs[0])
    if surface is not None:
        tree.links.new(surface, output.inputs["Surface"])
    return out


def bsdf(tree: bpy.types.NodeTree, spec: dict, picture: str | None) -> bpy.types.NodeSocket:
    node = tree.nodes.new(spec["node"])
    for name, value in spec.get("settings", {}).items():
        setattr(node, name, value)
    for name, value in spec["inputs"].items():
        node.inputs[name].default_value = value
    if picture and spec["color"]:
        texture = tree.nodes.new("ShaderNodeTexImage")
        texture.image = bpy.data.images.load(picture, check_existing=True)
        tree.links.new(texture.outputs["Color"], node.inputs[spec["color"]])
    return node.outputs[0]


def mixed(tree: bpy.types.NodeTree, a: bpy.types.NodeSocket, b: bpy.types.NodeSocket, share: float):
    node = tree.nodes.new("ShaderNodeMixShader")
    node.inputs[0].default_value = share
    tree.links.new(a, node.inputs[1])
    tree.links.new(b, node.inputs[2])
    return node.outputs[0]


def added(tree: bpy.types.NodeTree, a: bpy.types.NodeSocket, b: bpy.types.NodeSocket):
    node = tree.nodes.new("ShaderNodeAddShader")
    tree.links.new(a, node.inputs[0])
    tree.links.new(b, node.inputs[1])
    return node.outputs[0]


def mesh(scene: bpy.types.Scene, name: str, spec: dict, surface: bpy.types.Material) -> None:
    vertices, corners = spec["vertices"], 3 * spec["triangles"]
    positions, normals, uvs, index = array("f"), array("f"), array("f"), array("i")
    with open(spec["file"], "rb") as file:
        positions.fromfile(file, 3 * vertices)
        if spec["normals"]:
            normals.fromfile(file, 3 * vertices)
        index.fromfile(file, corners)
        if spec["uvs"]:
            uvs.fromfile(file, 2 * corners)
    data = bpy.data.meshes.new(name)
    data.vertices.add(vertices)
    data.vertices.foreach_set("co", positions)
    data.loops.add(corners)
    data.loops.foreach_set("vertex_index", index)
    data.polygons.add(spec["triangles"])
    data.polygons.foreach_set("loop_start", array("i", range(0, corners, 3)))
    if spec["uvs"]:
        data.uv_layers.new(name="uv", do_init=False).uv.foreach_set("vector", uvs)
    data.polygons.foreach_set("use_smooth", array("b", [spec["normals"]]) * spec["triangles"])
    data.update(calc_edges=True)
    if spec["normals"]:
        data.attributes.new("custom_normal", "FLOAT_VECTOR", "POINT").data.foreach_set("vector", normals)
    data.materials.append(surface)
    scene.collection.objects.link(bpy.data.objects.new(name, data))


# ---- Times ---------------------------------------------------------------------------------------


def render_all(scene: bpy.types.Scene, job: dict) -> list[list[float]]:
    """Renders and keeps the pictures; gives rows of samples and seconds, of an eighth, a half and all samples."""
    samples, seed = job["samples"], 0

    def render(count: int) -> list[float]:
        nonlocal seed
        seed += 1
        scene.cycles.samples, scene.cycles.seed = count, seed
        # Otherwise Blender may take the scene for what it was.
        scene.update_tag()
        bpy.context.view_layer.update()
        start = time.perf_counter()
        bpy.ops.render.render()
        return [count, time.perf_counter() - start]

    # The first loads kernels and builds the hierarchy; the second fills what the first left for later.
    render(1)
    render(max(1, samples // 8))
    times = []
    for picture in range(job["pictures"]):
        times += [render(max(1, samples // 8)), render(samples)]
        bpy.data.images["Render Result"].save_render(os.path.join(job["folder"], f"{picture}.exr"))
    return times + [render(samples // 2) for _ in range(2)]


main()
