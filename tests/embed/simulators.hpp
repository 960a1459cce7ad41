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
  double m_maxLinearForce, m_maxAngularTorque, m_maxLinearStiffness, m_maxAngularStiffness;
  bool m_sensedRotation, m_actuatedRotation;
};
struct cGenericHapticDevice {
  bool open();
  bool close();
  cHapticDeviceInfo getSpecifications();
  bool getPosition(cVector3d&);
  bool getRotation(cMatrix3d&);
  bool getUserSwitches(unsigned int&);
  bool setForceAndTorqueAndGripperForce(const cVector3d&, const cVector3d&, double);
};
using cGenericHapticDevicePtr = std::shared_ptr<cGenericHapticDevice>;

struct cColorb {};
struct cImage {
  void setVoxelColor(unsigned int, unsigned int, unsigned int, const cColorb&);
};
struct cTexture3d {
  std::shared_ptr<cImage> m_image;
  void markForPartialUpdate(cVector3d, cVector3d);
};
struct cVoxelObject {
  cVector3d m_minCorner, m_maxCorner;
  void setLocalPos(const cVector3d&);
};

struct cWorld;
class cToolCursor {
 public:
  explicit cToolCursor(cWorld*);
  virtual ~cToolCursor() = default;
  virtual void computeInteractionForces();
  cVector3d getDeviceGlobalPos() const;
  cMatrix3d getDeviceGlobalRot() const;
  bool getUserSwitch(int) const;
  void addDeviceGlobalForce(const cVector3d&);
  void addDeviceGlobalTorque(const cVector3d&);
};

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
