# Checks what Godot imported against what a set's manifest says. Run by .ci/godot.sh in a project of its own.
extends SceneTree

var faults = []


func _init():
	var folder = Directory.new()
	folder.open("res://")
	folder.list_dir_begin(true)
	var name = folder.get_next()
	var count = 0
	while name != "":
		if name.ends_with(".manifest.json"):
			var file = File.new()
			file.open("res://" + name, File.READ)
			for variant in parse_json(file.get_as_text())["variants"]:
				for asset in variant["assets"]:
					if asset["engine"] == "Godot":
						check(variant, asset["files"][0])
						count += 1
		name = folder.get_next()
	if count == 0:
		faults.append("no manifest names a file for Godot")
	for fault in faults:
		printerr("godot: " + fault)
	print("%d scenes, %d faults" % [count, faults.size()])
	OS.exit_code = 1 if faults.size() > 0 else 0
	quit()


func expect(what, seen, wanted):
	if typeof(seen) != typeof(wanted) or seen != wanted:
		faults.append("%s: %s, and %s is right" % [what, str(seen), str(wanted)])


func check(variant, file):
	var scene = load("res://" + file)
	if scene == null:
		faults.append(file + ": was not imported")
		return
	var root = scene.instance()
	var levels = {}
	var bodies = []
	walk(root, levels, bodies)
	var told = []
	expect(file + ": levels", levels.size(), variant["levels"].size())
	for level in variant["levels"]:
		var node = levels.get(level["mesh"])
		if node == null:
			faults.append("%s: there is no node %s" % [file, level["mesh"]])
			continue
		# Below the root that Godot adds; it takes the scene's name, which is the variant's too.
		expect(level["mesh"] + "'s parent", node.get_parent().name, variant["name"] + " 2")
		expect(level["mesh"] + "'s parent's parent", node.get_parent().get_parent(), root)
		var vertices = 0
		var triangles = 0
		for surface in node.mesh.get_surface_count():
			vertices += node.mesh.surface_get_array_len(surface)
			triangles += node.mesh.surface_get_array_index_len(surface) / 3
			var material = node.mesh.surface_get_material(surface)
			if not material is SpatialMaterial:
				faults.append("%s: surface %d has no material" % [level["mesh"], surface])
				continue
			for texture in [material.albedo_texture, material.normal_texture, material.roughness_texture, material.ao_texture]:
				if texture == null or texture.get_width() == 0:
					faults.append("%s: %s lacks a texture" % [level["mesh"], material.resource_name])
		expect(level["mesh"] + ": vertices", vertices, int(level["vertices"]))
		expect(level["mesh"] + ": triangles", triangles, int(level["triangles"]))
		told.append("%d/%d" % [vertices, triangles])
	expect(file + ": static bodies", bodies.size(), variant["capsules"].size())
	for body in bodies:
		var shapes = 0
		for child in body.get_children():
			if child is CollisionShape and child.shape is ConvexPolygonShape and child.shape.points.size() >= 4:
				shapes += 1
		expect("%s: convex shapes of %s" % [file, body.name], shapes, 1)
	print("%s: vertices/triangles %s; %d static bodies" % [file, PoolStringArray(told).join(", "), bodies.size()])
	root.free()


func walk(node, levels, bodies):
	if node is StaticBody:
		bodies.append(node)
	elif node is MeshInstance:
		levels[node.name] = node
	for child in node.get_children():
		walk(child, levels, bodies)
