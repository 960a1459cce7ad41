// SPDX-License-Identifier: MIT
using System;
using System.Runtime.InteropServices;

// The C interface in C#: its structs with their fields' own names, its handles as SafeHandles, its errors as exceptions.
// Units, frames and the rules for threads are those that trephine_c.h documents. C# 7 and .NET Framework 4.x suffice.
namespace Trephine
{
    [StructLayout(LayoutKind.Sequential)]
    public struct Double3
    {
        public double x, y, z;
        public Double3(double x, double y, double z) { this.x = x; this.y = y; this.z = z; }
        public double Length { get { return Math.Sqrt(x * x + y * y + z * z); } }
        public static Double3 operator *(double s, Double3 v) { return new Double3(s * v.x, s * v.y, s * v.z); }
    }

    [StructLayout(LayoutKind.Sequential)]
    public struct Double4
    {
        public double x, y, z, w;
        public Double4(double x, double y, double z, double w) { this.x = x; this.y = y; this.z = z; this.w = w; }
    }

    [StructLayout(LayoutKind.Sequential)]
    public struct Int3
    {
        public int x, y, z;
        public Int3(int x, int y, int z) { this.x = x; this.y = y; this.z = z; }
    }

    [StructLayout(LayoutKind.Sequential)]
    public struct RigidPose
    {
        public Double3 position;
        public Double4 rotation;
        public RigidPose(Double3 position, Double4 rotation) { this.position = position; this.rotation = rotation; }
    }

    [StructLayout(LayoutKind.Sequential)]
    public struct GridOptions
    {
        public uint struct_size;
        public int density_type;
        public Int3 size;
        public int keep_original;
        public Double3 spacing;
        public RigidPose X_WG;
        public double outside;
        public static GridOptions Default() { return Native.Default<GridOptions>(Native.trephine_grid_options_init); }
    }

    [StructLayout(LayoutKind.Sequential)]
    public struct Tool { public double tip_radius, shaft_radius, shaft_length; }

    public enum Algorithm { Line, Surface, Coupled }
    public enum Milling { Nothing, Geometric, RateLimited, ByLaw }

    [StructLayout(LayoutKind.Sequential)]
    public struct SceneOptions
    {
        public uint struct_size;
        public Algorithm algorithm;
        public double isovalue;
        public Tool tool;
        public double stiffness;
        public int sphere_vertices, slices, per_slice, shaft_vertices;
        public double static_friction, kinetic_friction, damping, angular_damping;
        public Milling milling;
        public int reserved;
        public double milling_rate, milling_force, force_limit, torque_limit, rotational_stiffness;
        public IntPtr tool_name;  // set by DrillScene.Create
        public double spindle_speed, force_scale, stall_torque, soft_density, cortical_density;
        public static SceneOptions Default() { return Native.Default<SceneOptions>(Native.trephine_scene_options_init); }
    }

    public enum Status { Ok, WorkBound, StartedInside, Jump, BadInput, NonFinite, FarAway }

    [StructLayout(LayoutKind.Sequential)]
    public struct TickResult
    {
        public uint struct_size;
        public Status status;
        public Double3 force, torque;
        public double depth, removed_mm3, removed_total_mm3;
        public RigidPose X_WV;
        public int contacts;
        public byte tip, shaft;
        public ushort reserved;
        public int nearest, warns;
        public double distance;
        public Double3 push_force, push_torque;
        public double refused_mm3, taken_mm3, thrust, spindle_torque, spindle_speed, feed;
        public static TickResult Default() { return Native.Default<TickResult>(Native.trephine_tick_result_init); }
    }

    [StructLayout(LayoutKind.Sequential)]
    public struct LabelsOptions
    {
        public uint struct_size;
        public Int3 size;
        public Double3 spacing;
        public RigidPose X_GS;
        public double reach;
        public int threads, raw;
        public static LabelsOptions Default() { return Native.Default<LabelsOptions>(Native.trephine_labels_options_init); }
    }

    public enum GuardMode { Off, Warn, Push }
    public enum VetoMode { Free, Watch, Protect, KeepIn }

    [StructLayout(LayoutKind.Sequential)]
    public struct StructureOptions
    {
        public uint struct_size;
        public GuardMode guard;
        public double margin, stiffness, greatest_force, damping;
        public VetoMode veto;
        public int reserved;
        public double veto_margin;
        public static StructureOptions Default() { return Native.Default<StructureOptions>(Native.trephine_structure_options_init); }
    }

    [StructLayout(LayoutKind.Sequential)]
    public struct GuardOptions
    {
        public uint struct_size;
        public int push;
        public double ramp_time, smoothing, linear_budget, angular_budget;
        public static GuardOptions Default() { return Native.Default<GuardOptions>(Native.trephine_guard_options_init); }
    }

    [StructLayout(LayoutKind.Sequential)]
    public struct StructureTotals
    {
        public uint struct_size;
        public int breaches;
        public double refused_mm3, taken_mm3;
        public static StructureTotals Default() { return Native.Default<StructureTotals>(Native.trephine_structure_totals_init); }
    }

    [Flags]
    public enum MeshFlags { None = 0, Mirrored = 1, Clockwise = 2, Unity = 3, Unreal = 1 }

    // Code is a trephine_result.
    public sealed class TrephineException : Exception
    {
        public readonly int Code;
        public TrephineException(int code, string message) : base(message) { Code = code; }
    }

    // From right-handed axes to left-handed ones and back, by mirroring z.
    public static class Mirror
    {
        public static RigidPose Pose(RigidPose pose) { Native.trephine_mirror_pose(ref pose, out pose); return pose; }
        public static Double3 Force(Double3 v) { Native.trephine_mirror_force(ref v, out v); return v; }
        public static Double3 Torque(Double3 v) { Native.trephine_mirror_torque(ref v, out v); return v; }
    }
}
