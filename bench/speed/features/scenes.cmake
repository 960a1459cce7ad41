# SPDX-License-Identifier: MIT
# The scenes whose cost is compared: a translation unit for each, from scene.cpp.in. Sets feature_sources.
set(feature_sources)

# feature_scene(RENDERER NAME "HEADERS" "EXPRESSION"): headers of trephine/, without that and .hpp.
function(feature_scene renderer name headers scene)
  set(includes)
  foreach(header IN LISTS headers)
    if(header MATCHES "^speed/")
      string(APPEND includes "#include \"${header}.hpp\"\n")
    else()
      string(APPEND includes "#include <trephine/${header}.hpp>\n")
    endif()
  endforeach()
  set(source ${CMAKE_CURRENT_BINARY_DIR}/features/${renderer}_${name}.cpp)
  configure_file(speed/features/scene.cpp.in ${source} @ONLY)
  list(APPEND feature_sources ${source})
  set(feature_sources ${feature_sources} PARENT_SCOPE)
endfunction()

# Parts that any renderer goes with: "name|headers|parts". Each does nothing by its numbers, or by the spindle that
# stands still (Milling).
set(stages
    "carving|stage/milling|Milling{}"
    "vibration|stage/milling_vibration|MillingVibration{{.per_force = 0}}"
    "hunt_crossley|stage/hunt_crossley|HuntCrossley{{.lambda = 0}}"
    "damping|stage/damping|Damping{Damping::Options{}}"
    "filter|stage/first_order_filter|FirstOrderFilter{{.cutoff = 1e9}}"
    "passivity|stage/passivity_controller|PassivityController{{.damping = 0, .angular_damping = 0}}"
    "rate_limit|stage/wrench_rate_limit|WrenchRateLimit{{.force = 1e12, .torque = 1e12}}"
    "limits|stage/device_limits|DeviceLimits{.force = 1e12, .torque = 1e12}")
set(all_headers)
set(all_parts)
foreach(stage IN LISTS stages)
  string(REPLACE "|" ";" stage "${stage}")
  list(GET stage 1 header)
  list(GET stage 2 part)
  list(APPEND all_headers ${header})
  string(APPEND all_parts ", ${part}")
endforeach()

set(tool_line "ToolDiscretization{settings.burr, LineCounts{}}, LineOptions{.budget = settings.budget}")
set(tool_surface "ToolDiscretization{settings.burr, SurfaceCounts::thesis()}, SurfaceOptions{.budget = settings.budget}")
set(tool_coupled "settings.burr, CoupledOptions{.rotational_stiffness = settings.rotational_stiffness}")
set(type_line LineApproxRenderer)
set(type_surface SurfaceApproxRenderer)
set(type_coupled CoupledToolRenderer)
set(friction_line ", TranslateRotate{}, Coulomb{0, 0}")
set(friction_coupled ", Coulomb{0, 0}")
set(torque_only_line "LineApproxRenderer<float, TranslateRotate, ConstrainedTracking, Frictionless, TorqueOnly>")
set(torque_only_surface "SurfaceApproxRenderer<float, PatchWeights, ExtendAlongSurface, TorqueOnly>")

foreach(renderer line surface coupled)
  set(header render/${renderer}_approx_renderer)
  if(renderer STREQUAL "coupled")
    set(header render/coupled/coupled_tool_renderer)
  endif()
  set(needs speed/features/scene ${header})
  set(made "${type_${renderer}}(${tool_${renderer}})")
  feature_scene(${renderer} bare "${needs}" "scene_of(place, ${made})")
  feature_scene(${renderer} bare_of_all_headers "${needs};trephine" "scene_of(place, ${made})")
  feature_scene(${renderer} force_only "${needs}" "scene_of(place, ${made}, ForceOnly{})")
  foreach(stage IN LISTS stages)
    string(REPLACE "|" ";" stage "${stage}")
    list(GET stage 0 name)
    list(GET stage 1 stage_header)
    list(GET stage 2 part)
    feature_scene(${renderer} ${name} "${needs};${stage_header}" "scene_of(place, ${made}, ${part})")
  endforeach()
  feature_scene(${renderer} all_stages "${needs};${all_headers}" "scene_of(place, ${made}${all_parts})")
  feature_scene(${renderer} skip_far "${needs};voxel/clearance_map" "scene_of(place, ${made}, EmptySpaceSkipping{place.air})")
  if(DEFINED friction_${renderer})
    feature_scene(${renderer} friction "${needs}"
                  "scene_of(place, ${type_${renderer}}(${tool_${renderer}}${friction_${renderer}}))")
  endif()
  if(DEFINED torque_only_${renderer})
    set(made "${torque_only_${renderer}}(${tool_${renderer}})")
    feature_scene(${renderer} shaft_torque "${needs}" "scene_of(place, ${made})")
    feature_scene(${renderer} shaft_torque_force_only "${needs}" "scene_of(place, ${made}, ForceOnly{})")
  endif()
endforeach()
feature_scene(coupled translation "speed/features/scene;render/coupled/coupled_tool_renderer"
              "scene_of(place, CoupledToolRenderer<double, BallAndShaft, Frictionless, TranslationOnly>(${tool_coupled}), ForceOnly{})")
set(looped "place, settings, SurfaceApproxRenderer(${tool_surface})")
feature_scene(surface loop "speed/features/loop;render/surface_approx_renderer" "loop_of(${looped}, NoObserver{})")
feature_scene(surface recorder "speed/features/loop;render/surface_approx_renderer;device/recorder"
              "loop_of(${looped}, Recorder(4096))")
