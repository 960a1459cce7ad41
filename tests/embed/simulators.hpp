// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>

#include <memory>

/// Declarations in the place of the simulators that examples/embed/README.md connects: the calls it makes and no more,
/// written from their public documentation. They show that our side compiles, not that theirs is so.
namespace chai3d {

struct cVector3d {
  cVector3d() = default;
  cVector3d(double, double, double);
  double operator()(int) const;
};
struct cMatrix3d {
  double operator()(int, int) const;
};
struct cHapticDeviceInfo {
  double m_maxLinearForce, m_maxAngularTorque, m_maxLinearStiffness;
  bool m_actuatedRotation;
};
struct cGenericHapticDevice {
  cHapticDeviceInfo getSpecifications();
  bool getPosition(cVector3d&);
  bool getRotation(cMatrix3d&);
  bool getUserSwitches(unsigned int&);
  bool setForceAndTorqueAndGripperForce(const cVector3d&, const cVector3d&, double);
};
using cGenericHapticDevicePtr = std::shared_ptr<cGenericHapticDevice>;

}  // namespace chai3d

namespace HAPI {

struct Vec3 {
  Vec3(double, double, double);
  double x, y, z;
};
struct Rotation {
  Vec3 axis;
  double angle;
};
struct HAPIHapticsDevice {
  Vec3 getPosition();
  Rotation getOrientation();
  bool getButtonStatus(unsigned int);
};
class HAPIForceEffect {
 public:
  struct EffectInput {
    double deltaT;
    HAPIHapticsDevice* hd;
  };
  struct EffectOutput {
    EffectOutput(const Vec3&, const Vec3&);
  };
  virtual ~HAPIForceEffect() = default;
  virtual EffectOutput calculateForces(const EffectInput&) = 0;
};

}  // namespace HAPI

using SReal = double;

namespace sofa {
namespace type {

template <class Real>
struct Transform {
  const Real* getOrigin() const;
  const Real* getOrientation() const;
};
template <class Real>
struct SpatialVector {
  Real* getForce();
  Real* getTorque();
};

}  // namespace type
namespace component::haptics {

class ForceFeedback {
 public:
  virtual ~ForceFeedback() = default;
  virtual void computeForce(SReal, SReal, SReal, SReal, SReal, SReal, SReal, SReal&, SReal&, SReal&) = 0;
  virtual void computeWrench(const type::Transform<SReal>&, const type::SpatialVector<SReal>&,
                             type::SpatialVector<SReal>&) = 0;
};

}  // namespace component::haptics
}  // namespace sofa

namespace imstk {

struct DeviceClient {
  trephine::Vec3d getPosition();
  trephine::Quatd getOrientation();
  bool getButton(int);
  void setForce(const trephine::Vec3d&);
};

}  // namespace imstk
