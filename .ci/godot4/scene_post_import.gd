# Stands in for EditorScenePostImport, which only the editor has: the script of examples/engines/godot.md extends it.
extends RefCounted

var source_file := ""


func get_source_file() -> String:
	return source_file
