# Loads what jobs.json names by GLTFDocument, puts on it what the script of examples/engines/godot.md does, and draws it. It
# tells the page what it sees; .ci/godot4.mjs judges.
extends Node3D

# From where pictures are taken, radians: azimuth and height. None is a frame of an impostor's sheet.
const VIEWS: Array[Vector2] = [Vector2(0.3, 0.05), Vector2(2.4, 0.35), Vector2(4.5, 0.8)]
# Light of the sky where the sun's is 1.
const SKY := 0.5

var camera := Camera3D.new()
var sun := DirectionalLight3D.new()
var world := WorldEnvironment.new()
var page := JavaScriptBridge.get_interface("treewright")
var pictures := {}  # by the name of their file
var known := {}  # names by texture: to ask the graphics card takes long


func _ready() -> void:
	add_child(camera)
	sun.rotation_degrees = Vector3(-45, 35, 0)
	sun.shadow_enabled = true
	sun.directional_shadow_mode = DirectionalLight3D.SHADOW_ORTHOGONAL
	sun.directional_shadow_fade_start = 1.0
	add_child(sun)
	world.environment = Environment.new()
	world.environment.background_mode = Environment.BG_CLEAR_COLOR
	world.environment.ambient_light_source = Environment.AMBIENT_SOURCE_COLOR
	world.environment.ambient_light_color = Color.WHITE
	world.environment.ambient_light_energy = SKY
	add_child(world)
	for job: Dictionary in JSON.parse_string(FileAccess.get_file_as_string("res://jobs.json")):
		await run(job)
	page.told("done", Engine.get_version_info().string)


func run(job: Dictionary) -> void:
	var document := GLTFDocument.new()
	var state := GLTFState.new()
	var error := document.append_from_file(job.file, state)
	var scene := document.generate_scene(state) if error == OK else null
	var seen := {"file": job.file, "error": error_string(error), "nodes": []}
	if scene != null:
		add_child(scene)
		pictures.clear()
		known.clear()
		for file: String in job.pictures:
			pictures[file] = Image.load_from_file(job.file.get_base_dir().path_join(file))
		tell_nodes(scene, seen.nodes)
		if job.has("levels"):
			await as_profile(job, scene, seen)
		remove_child(scene)
		scene.queue_free()
	page.told("scene", JSON.stringify(seen))


func tell_nodes(node: Node, into: Array) -> void:
	var told := {
		"name": node.name, "parent": str(node.get_parent().get_path()), "extras": extras_of(node), "surfaces": [],
	}
	if node is MeshInstance3D:
		told.mesh_extras = extras_of(node.mesh)
		for i: int in node.mesh.get_surface_count():
			var arrays: Array = node.mesh.surface_get_arrays(i)
			told.surfaces.append({
				"vertices": arrays[Mesh.ARRAY_VERTEX].size(),
				"triangles": arrays[Mesh.ARRAY_INDEX].size() / 3,
				"material": tell_material(node.mesh.surface_get_material(i)),
			})
		if node.name.ends_with("-convcolonly"):
			told.hull = node.mesh.create_convex_shape().points.size()
	into.append(told)
	for child: Node in node.get_children():
		tell_nodes(child, into)


func extras_of(of: Object) -> Variant:
	return of.get_meta("extras") if of.has_meta("extras") else null


func tell_material(material: Material) -> Variant:
	var it := material as BaseMaterial3D
	if it == null:
		return null
	return {
		"name": it.resource_name,
		"scissor": it.alpha_scissor_threshold if it.transparency == BaseMaterial3D.TRANSPARENCY_ALPHA_SCISSOR else null,
		"opaque": it.transparency == BaseMaterial3D.TRANSPARENCY_DISABLED,
		"both_sides": it.cull_mode == BaseMaterial3D.CULL_DISABLED,
		"albedo": picture_of(it.albedo_texture),
		"normal": picture_of(it.normal_texture) if it.normal_enabled else "",
		"occlusion": [picture_of(it.ao_texture) if it.ao_enabled else "", it.ao_texture_channel],
		"roughness": [picture_of(it.roughness_texture), it.roughness_texture_channel],
		"metallic": [picture_of(it.metallic_texture), it.metallic_texture_channel],
	}


# The file whose texels a texture holds.
func picture_of(texture: Texture2D) -> String:
	if texture == null:
		return ""
	if not known.has(texture):
		known[texture] = file_of(texture.get_image())
	return known[texture]


func file_of(image: Image) -> String:
	for file: String in pictures:
		if pictures[file] != null and pictures[file].get_size() == image.get_size():
			var other: Image = pictures[file].duplicate()
			other.convert(image.get_format())
			if other.get_data() == image.get_data():
				return file
	return "none of the files"


# What a Godot profile promises, after the script of godot.md.
func as_profile(job: Dictionary, scene: Node, seen: Dictionary) -> void:
	var script: RefCounted = load("res://post_import.gd").new()
	script.source_file = job.file
	script._post_import(scene)
	for node: Node in scene.find_children("*-convcolonly", "MeshInstance3D", true, false):
		node.visible = false
	var levels: Array[MeshInstance3D] = []
	seen.ranges = []
	for level: Dictionary in job.levels:
		var node := scene.find_child(level.mesh, true, false) as MeshInstance3D
		if node == null:
			return
		levels.append(node)
		seen.ranges.append({
			"begin": node.visibility_range_begin, "end": node.visibility_range_end,
			"fades": node.visibility_range_fade_mode == GeometryInstance3D.VISIBILITY_RANGE_FADE_SELF,
		})

	# Which level is drawn in the middle of each range, told by what the engine counts. No shadows: they count, too.
	var middle := levels[0].get_aabb().get_center()
	var radius := levels[0].get_aabb().size.length() / 2.0
	sun.visible = false
	for i: int in levels.size():
		look(middle, radius, VIEWS[0], (levels[i].visibility_range_begin + levels[i].visibility_range_end) / 2.0)
		await settled()
		seen.ranges[i].drawn = get_viewport().get_render_info(
			Viewport.RENDER_INFO_TYPE_VISIBLE, Viewport.RENDER_INFO_PRIMITIVES_IN_FRAME)
	sun.visible = true

	if job.draw:
		seen.shader = levels[-1].mesh.surface_get_material(0) is ShaderMaterial
		await draw_both(levels, middle, radius)


# The full level and the impostor from the same places, as large. Light of the sky and of the sun apart, for the page to add:
# this renderer adds a sun with shadows to what is there already as the screen shows it, not as light.
func draw_both(levels: Array[MeshInstance3D], middle: Vector3, radius: float) -> void:
	for level: MeshInstance3D in levels:
		level.visibility_range_begin = 0.0
		level.visibility_range_end = 0.0
	var full := levels[0]
	var far := levels[-1]
	as_this_renderer_takes(full)
	for i: int in VIEWS.size():
		look(middle, radius, VIEWS[i], radius * 8.0)
		for level: MeshInstance3D in levels:
			level.visible = level == full
		sun.visible = false
		world.environment.ambient_light_energy = SKY
		await draw("%s_%d_sky" % [full.name, i])
		sun.visible = true
		world.environment.ambient_light_energy = 0.0
		await draw("%s_%d_sun" % [full.name, i])
		receive_shadows(full, false)
		await draw("%s_%d_open" % [full.name, i])
		receive_shadows(full, true)
		for level: MeshInstance3D in levels:
			level.visible = level == far
		await draw("%s_%d_sun" % [far.name, i])
		sun.shadow_enabled = false
		await draw("%s_%d_open" % [far.name, i])
		sun.shadow_enabled = true
		sun.visible = false
		world.environment.ambient_light_energy = SKY
		await draw("%s_%d_sky" % [far.name, i])
		sun.visible = true


func receive_shadows(node: MeshInstance3D, yes: bool) -> void:
	for i: int in node.mesh.get_surface_count():
		(node.mesh.surface_get_material(i) as BaseMaterial3D).disable_receive_shadows = not yes


# The Compatibility renderer, which alone runs on the web, multiplies vertex colours by colours that are not light yet; what
# glTF has is light. They are brought to where the product is the same: by the slope of its curve at a leaf's colours.
func as_this_renderer_takes(node: MeshInstance3D) -> void:
	var mesh := ArrayMesh.new()
	for i: int in node.mesh.get_surface_count():
		var arrays: Array = node.mesh.surface_get_arrays(i)
		var colors: PackedColorArray = arrays[Mesh.ARRAY_COLOR]
		for k: int in colors.size():
			var open := pow(colors[k].r, 1.0 / 2.06)
			colors[k] = Color(open, open, open)
		arrays[Mesh.ARRAY_COLOR] = colors
		# Of what type the wind's sets are, which the arrays alone do not tell: three bits each of the four.
		var customs: int = node.mesh.surface_get_format(i) & (0xfff << Mesh.ARRAY_FORMAT_CUSTOM_BASE)
		mesh.add_surface_from_arrays(Mesh.PRIMITIVE_TRIANGLES, arrays, [], {}, customs)
		mesh.surface_set_material(i, node.mesh.surface_get_material(i))
	node.mesh = mesh


func draw(name_of: String) -> void:
	await settled()
	var image := get_viewport().get_texture().get_image()
	image.convert(Image.FORMAT_RGBA8)
	page.picture(name_of, Marshalls.raw_to_base64(image.get_data()), Marshalls.raw_to_base64(image.save_png_to_buffer()))


# Turns the camera to a ball that fills the picture.
func look(middle: Vector3, radius: float, from: Vector2, distance: float) -> void:
	camera.position = middle + distance * Vector3(sin(from.x) * cos(from.y), sin(from.y), cos(from.x) * cos(from.y))
	camera.look_at(middle)
	camera.fov = maxf(rad_to_deg(2.0 * asin(minf(radius / distance, 0.9))), 1.0)  # it takes no less
	camera.near = maxf(distance - radius, radius * 0.01)
	camera.far = distance + radius
	sun.directional_shadow_max_distance = camera.far


# Until a frame is drawn that begins after this.
func settled() -> void:
	await get_tree().process_frame
	await RenderingServer.frame_post_draw
