// SPDX-License-Identifier: MIT
#pragma once

#include "bone.hpp"
#include "session.hpp"
#include "tool.hpp"

#include <trephine/compiled/structures.hpp>

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

namespace trephine_python {

/// Structures with the labels that make them again.
struct PythonStructures : compiled::Structures {
  PythonStructures(const compiled::LabelGeometry& of, std::vector<std::uint8_t> from)
      : compiled::Structures(of, from), geometry(of), labels(std::move(from)) {}

  compiled::LabelGeometry geometry;
  std::vector<std::uint8_t> labels;
};
using StructuresPointer = std::shared_ptr<PythonStructures>;

/// Structures with what a scene does about each.
struct SceneStructures {
  StructuresPointer distances;
  std::vector<ProtectedStructure> each;
  ProtectionOptions options;
};

/// A scene, and what it was made of.
struct PythonScene {
  BonePointer bone;
  double isovalue;
  SceneTool tool;
  compiled::RendererOptions renderer;
  std::optional<SceneStructures> structures;
  compiled::Scene scene;

  PythonScene(BonePointer of, double at, const SceneTool& with, const compiled::RendererOptions& by,
              const compiled::StageOptions& stages);
  explicit PythonScene(const PythonScene& other);
  PythonScene& operator=(const PythonScene&) = delete;
  void take(const PythonScene& other);
  /// Guards structures and keeps cuts from them, instead of those before. Needs no lock of Python's.
  void set_structures(SceneStructures made);
};
using ScenePointer = std::shared_ptr<PythonScene>;

/// Members of a scene that other parts of the module have.
void bind_protection(py::class_<PythonScene, ScenePointer>& scene);
void bind_records(py::class_<PythonScene, ScenePointer>& scene);
void bind_state(py::class_<PythonScene, ScenePointer>& scene);

/// Inputs of many ticks: an array of poses, and spindle and dt that are one for all or one a tick.
class Inputs {
 public:
  /// `scenes` is -1 for poses (N, ...), else poses are (scenes, N, ...). Throws std::invalid_argument for shapes that
  /// do not fit, a dt that is not above 0, or a matrix that is no pose.
  Inputs(const char* who, py::ssize_t scenes, const Numbers& poses, const py::object& spindle, const py::object& dt);

  [[nodiscard]] std::size_t ticks() const noexcept { return ticks_; }
  [[nodiscard]] const std::vector<py::ssize_t>& shape() const noexcept { return shape_; }
  [[nodiscard]] TickInput input(std::size_t i) const noexcept {
    return {.X_WT = seven_ ? pose_of_seven(pose_at_ + 7 * i) : pose_of_rows(pose_at_ + 16 * i),
            .spindle_on = spindle_at_[i * spindle_step_]};
  }
  [[nodiscard]] double dt(std::size_t i) const noexcept { return dt_at_[i * dt_step_]; }

 private:
  Numbers poses_, dt_;
  py::array_t<bool, py::array::c_style> spindle_;
  std::vector<py::ssize_t> shape_;
  std::size_t ticks_ = 0;
  bool seven_ = false;
  const double* pose_at_ = nullptr;
  const double* dt_at_ = nullptr;
  const bool* spindle_at_ = nullptr;
  std::size_t dt_step_ = 0, spindle_step_ = 0;
};

/// Results of many ticks as arrays in a dict, a row a tick.
class Columns {
 public:
  /// Reports of structures and of the law have columns only where a scene has them.
  Columns(const std::vector<py::ssize_t>& shape, bool structures, bool law);

  void put(std::size_t row, const TickResult& r) noexcept;
  [[nodiscard]] const py::dict& dict() const noexcept { return dict_; }

 private:
  template <class Number>
  Number* column(const char* name, std::vector<py::ssize_t> shape, bool vector = false);

  py::dict dict_;
  double *force_, *torque_, *removed_, *depth_;
  std::uint8_t* status_;
  std::int32_t* contacts_;
  bool *tip_, *shaft_;
  double *distance_ = nullptr, *push_force_ = nullptr, *push_torque_ = nullptr, *refused_ = nullptr, *taken_ = nullptr;
  std::int32_t* nearest_ = nullptr;
  bool* warns_ = nullptr;
  double *thrust_ = nullptr, *spindle_torque_ = nullptr, *spindle_speed_ = nullptr, *feed_ = nullptr;
};

}  // namespace trephine_python
