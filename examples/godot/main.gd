extends Node3D
## Walks a creature about with the arrow keys: up and down walk, left and right turn.
##
## The clips are those of `arc-suite animate`. The root bone moves the creature, so that feet
## keep to the ground at any frame rate.

const CREATURE := "res://creature.glb"
const FADE := 0.15  # s, between two clips that do not meet in a pose
## Clips by what the keys ask for: walk ahead (1) or back (-1), turn left (1) or right (-1).
const CLIPS := {
	Vector2i(1, 0): "walk",
	Vector2i(1, 1): "turn_left",
	Vector2i(1, -1): "turn_right",
	Vector2i(0, 1): "turn_in_place_left",
	Vector2i(0, -1): "turn_in_place_right",
	Vector2i(-1, 0): "back",
	Vector2i(0, 0): "idle",
}

var creature: Node3D
var player: AnimationPlayer
var current := ""


func _ready() -> void:
	creature = (load(CREATURE) as PackedScene).instantiate()
	add_child(creature)
	player = creature.find_children("*", "AnimationPlayer")[0]
	var skeleton: Node = creature.find_children("*", "Skeleton3D")[0]
	var path := player.get_node(player.root_node).get_path_to(skeleton)
	player.root_motion_track = NodePath("%s:root" % path)
	_add_surroundings()
	_play("idle", 0.0)


func _process(_delta: float) -> void:
	var wanted := _wanted()
	if wanted != current:
		_change(wanted)
	var turn := player.get_root_motion_rotation()
	var moved := player.get_root_motion_position()
	var heading := creature.quaternion
	creature.quaternion = heading * turn
	var accumulated := player.get_root_motion_rotation_accumulator()
	creature.position += (accumulated.inverse() * creature.quaternion) * moved


func _wanted() -> String:
	var ahead := roundi(Input.get_axis("ui_down", "ui_up"))
	var left := roundi(Input.get_axis("ui_right", "ui_left"))
	var clip: String = CLIPS.get(Vector2i(ahead, left), "walk")
	return clip if _animation(clip) else "idle"


func _change(wanted: String) -> void:
	var walks := current == "walk"
	current = wanted
	if player.current_animation == _animation("idle") and wanted == "walk" and _animation("start"):
		player.play(_animation("start"))  # begins with the pose of idle, ends with that of the walk
		player.queue(_animation("walk"))
	elif walks and wanted == "idle" and _animation("stop"):
		player.play(_animation("stop"), FADE)
		player.queue(_animation("idle"))
	else:
		_play(wanted, FADE)


func _play(clip: String, fade: float) -> void:
	current = clip
	player.play(_animation(clip), fade)


## The animation of a clip, or "". The importer may take `_loop` from the names of loops.
func _animation(clip: String) -> String:
	for animation: String in [clip, clip + "_loop"]:
		if player.has_animation(animation):
			return animation
	return ""


func _add_surroundings() -> void:
	var ground := MeshInstance3D.new()
	ground.mesh = PlaneMesh.new()
	ground.mesh.size = Vector2(100.0, 100.0)
	add_child(ground)
	var sun := DirectionalLight3D.new()
	sun.rotation = Vector3(-0.9, 0.5, 0.0)
	sun.shadow_enabled = true
	add_child(sun)
	var camera := Camera3D.new()
	creature.add_child(camera)
	camera.look_at_from_position(Vector3(0.0, 2.0, -4.0), Vector3(0.0, 0.3, 1.0))
