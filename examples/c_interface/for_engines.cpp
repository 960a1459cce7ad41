// SPDX-License-Identifier: MIT
// Meshes of bone, a ramp for a wrench and left-handed axes: for engines that draw, and for loops of their own.
#include "handles.hpp"
#include "trephine_c.h"

#include <trephine/core/finite.hpp>
#include <trephine/device/servo_options.hpp>
#include <trephine/device/tickable_scene.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

using namespace trephine;
using namespace trephine_c;

namespace {

template <class Number>
void copy_all(const std::vector<std::array<Number, 3>>& from, Number* to) {
  for (const auto& three : from) to = std::copy(three.begin(), three.end(), to);
}

void mirror_z(const double* from, double* to) {
  std::copy(from, from + 3, to);
  to[2] = -to[2];
}
/// The axis of a rotation turns the other way when it is mirrored.
void mirror_axis(const double* from, double* to) {
  mirror_z(from, to);
  for (int i = 0; i < 3; ++i) to[i] = -to[i];
}

}  // namespace

trephine_result trephine_reader_mesh(trephine_reader* reader, int32_t brick, double isovalue, int32_t flags,
                                     size_t* vertices, size_t* indices) noexcept {
  return guarded([&] {
    require_pointers(reader, vertices, indices);
    require(brick >= 0 && static_cast<std::size_t>(brick) < reader->brick_count(),
            "trephine_reader_mesh: there is no brick ", brick);
    require((flags & ~(TREPHINE_MESH_MIRRORED | TREPHINE_MESH_CLOCKWISE)) == 0,
            "trephine_reader_mesh: no such flags: ", flags);
    std::vector<std::array<float, 3>> normals;
    Mesh mesh = reader->reader.mesh(static_cast<std::size_t>(brick), isovalue, &normals);
    if ((flags & TREPHINE_MESH_MIRRORED) != 0) {
      for (auto& p : mesh.vertices) p[2] = -p[2];
      for (auto& n : normals) n[2] = -n[2];
    }
    if ((flags & TREPHINE_MESH_CLOCKWISE) != 0)
      for (auto& t : mesh.triangles) std::swap(t[1], t[2]);
    reader->mesh = std::move(mesh);
    reader->normals = std::move(normals);
    *vertices = reader->mesh.vertices.size();
    *indices = 3 * reader->mesh.triangles.size();
  });
}

trephine_result trephine_reader_copy_mesh(const trephine_reader* reader, float* positions, float* normals,
                                          size_t vertex_room, uint32_t* indices, size_t index_room) noexcept {
  return guarded([&] {
    require_pointers(reader);
    const Mesh& mesh = reader->mesh;
    require(vertex_room >= mesh.vertices.size() && index_room >= 3 * mesh.triangles.size(),
            "trephine_reader_copy_mesh: needs room for ", mesh.vertices.size(), " vertices and ",
            3 * mesh.triangles.size(), " indices, got ", vertex_room, " and ", index_room);
    if (mesh.triangles.empty()) return;
    require_pointers(positions, indices);
    copy_all(mesh.vertices, positions);
    if (normals != nullptr) copy_all(reader->normals, normals);
    copy_all(mesh.triangles, indices);
  });
}

trephine_result trephine_ramp_create(double duration, trephine_ramp** ramp) noexcept {
  return guarded([&] {
    require_pointers(ramp);
    require(duration >= 0 && is_finite(duration), "trephine_ramp_create: duration must be >= 0 s, got ", duration);
    *ramp = std::make_unique<trephine_ramp>(trephine_ramp{Ramp(duration)}).release();
  });
}

void trephine_ramp_destroy(trephine_ramp* ramp) noexcept { delete ramp; }

trephine_result trephine_ramp_step(trephine_ramp* ramp, const trephine_scene* scene, int32_t status, double dt,
                                   double* factor) noexcept {
  return guarded([&] {
    require_pointers(ramp, scene, factor);
    const bool flows = dt > 0 && dt <= ServoOptions{}.stall_time;
    TickResult result;
    result.status = static_cast<Status>(status);
    if (ramp->anew || !flows || needs_ramp(scene->scene, result))
      ramp->ramp.restart();
    else
      ramp->ramp.advance(dt);
    ramp->anew = false;
    *factor = ramp->ramp.gain();
  });
}

trephine_result trephine_ramp_restart(trephine_ramp* ramp) noexcept {
  return guarded([&] {
    require_pointers(ramp);
    ramp->anew = true;
  });
}

trephine_result trephine_mirror_pose(const trephine_pose* from, trephine_pose* to) noexcept {
  return guarded([&] {
    require_pointers(from, to);
    const double w = from->rotation[3];
    mirror_z(from->position, to->position);
    mirror_axis(from->rotation, to->rotation);
    to->rotation[3] = w;
  });
}

trephine_result trephine_mirror_force(const double from[3], double to[3]) noexcept {
  return guarded([&] {
    require_pointers(from, to);
    mirror_z(from, to);
  });
}

trephine_result trephine_mirror_torque(const double from[3], double to[3]) noexcept {
  return guarded([&] {
    require_pointers(from, to);
    mirror_axis(from, to);
  });
}
