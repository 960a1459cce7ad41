// SPDX-License-Identifier: MIT
using System;
using System.Runtime.InteropServices;

namespace Trephine
{
    // The functions of trephine_c.h, in its order. Arrays and structs are passed where they lie, without a copy.
    internal static class Native
    {
        const string Library = "trephine_c";
        const CallingConvention C = CallingConvention.Cdecl;

        internal delegate int Init<T>(out T o, UIntPtr size);
        internal static T Default<T>(Init<T> init)
        {
            T o;
            Check(init(out o, (UIntPtr)(uint)Marshal.SizeOf(typeof(T))));
            return o;
        }

        internal static void Check(int code)
        {
            if (code != 0) throw new TrephineException(code, Marshal.PtrToStringAnsi(trephine_last_error()));
        }

        [DllImport(Library, CallingConvention = C)] internal static extern IntPtr trephine_last_error();
        [DllImport(Library, CallingConvention = C)] internal static extern int trephine_version();

        [DllImport(Library, CallingConvention = C)] internal static extern int trephine_grid_options_init(out GridOptions o, UIntPtr size);
        [DllImport(Library, CallingConvention = C)] internal static extern int trephine_grid_create(ref GridOptions o, [In] short[] voxels, UIntPtr bytes, out BoneGrid grid);
        [DllImport(Library, CallingConvention = C)] internal static extern int trephine_grid_create(ref GridOptions o, [In] float[] voxels, UIntPtr bytes, out BoneGrid grid);
        [DllImport(Library, CallingConvention = C)] internal static extern void trephine_grid_destroy(IntPtr grid);
        [DllImport(Library, CallingConvention = C)] internal static extern int trephine_grid_set_pose(BoneGrid grid, ref RigidPose X_WG);
        [DllImport(Library, CallingConvention = C)] internal static extern int trephine_grid_restore(BoneGrid grid, UIntPtr most, out UIntPtr left);
        [DllImport(Library, CallingConvention = C)] internal static extern int trephine_grid_copy(BoneGrid grid, [Out] short[] voxels, UIntPtr bytes);
        [DllImport(Library, CallingConvention = C)] internal static extern int trephine_grid_copy(BoneGrid grid, [Out] float[] voxels, UIntPtr bytes);

        [DllImport(Library, CallingConvention = C)] internal static extern int trephine_scene_options_init(out SceneOptions o, UIntPtr size);
        [DllImport(Library, CallingConvention = C)] internal static extern int trephine_scene_create(BoneGrid grid, ref SceneOptions o, out DrillScene scene);
        [DllImport(Library, CallingConvention = C)] internal static extern void trephine_scene_destroy(IntPtr scene);
        [DllImport(Library, CallingConvention = C)] internal static extern int trephine_tick_result_init(out TickResult r, UIntPtr size);
        [DllImport(Library, CallingConvention = C)] internal static extern int trephine_scene_tick(DrillScene scene, ref RigidPose X_WT, int spindle, double dt, ref TickResult r);
        [DllImport(Library, CallingConvention = C)] internal static extern int trephine_scene_set_tool(DrillScene scene, [MarshalAs(UnmanagedType.LPStr)] string name);
        [DllImport(Library, CallingConvention = C)] internal static extern int trephine_scene_reset(DrillScene scene);

        [DllImport(Library, CallingConvention = C)] internal static extern int trephine_labels_options_init(out LabelsOptions o, UIntPtr size);
        [DllImport(Library, CallingConvention = C)] internal static extern int trephine_structures_create(ref LabelsOptions o, [In] byte[] labels, UIntPtr bytes, out BoneStructures s);
        [DllImport(Library, CallingConvention = C)] internal static extern void trephine_structures_destroy(IntPtr s);
        [DllImport(Library, CallingConvention = C)] internal static extern int trephine_structures_count(BoneStructures s, out int count);
        [DllImport(Library, CallingConvention = C)] internal static extern int trephine_structure_options_init(out StructureOptions o, UIntPtr size);
        [DllImport(Library, CallingConvention = C)] internal static extern int trephine_structures_set(BoneStructures s, int structure, ref StructureOptions o);
        [DllImport(Library, CallingConvention = C)] internal static extern int trephine_structures_set_name(BoneStructures s, int structure, [MarshalAs(UnmanagedType.LPStr)] string name);
        [DllImport(Library, CallingConvention = C)] internal static extern int trephine_structures_name(BoneStructures s, int structure, out IntPtr name);
        [DllImport(Library, CallingConvention = C)] internal static extern int trephine_guard_options_init(out GuardOptions o, UIntPtr size);
        [DllImport(Library, CallingConvention = C)] internal static extern int trephine_structures_set_guard(BoneStructures s, ref GuardOptions o);
        [DllImport(Library, CallingConvention = C)] internal static extern int trephine_scene_set_structures(DrillScene scene, BoneStructures s);
        [DllImport(Library, CallingConvention = C)] internal static extern int trephine_scene_set_structures(DrillScene scene, IntPtr none);
        [DllImport(Library, CallingConvention = C)] internal static extern int trephine_protection_create(DrillScene scene, BoneStructures s, out Protection p);
        [DllImport(Library, CallingConvention = C)] internal static extern int trephine_protection_create(DrillScene scene, IntPtr none, out Protection p);
        [DllImport(Library, CallingConvention = C)] internal static extern void trephine_protection_destroy(IntPtr p);
        [DllImport(Library, CallingConvention = C)] internal static extern int trephine_scene_exchange(DrillScene scene, Protection p);
        [DllImport(Library, CallingConvention = C)] internal static extern int trephine_structure_totals_init(out StructureTotals t, UIntPtr size);
        [DllImport(Library, CallingConvention = C)] internal static extern int trephine_scene_structure_totals(DrillScene scene, int structure, ref StructureTotals t);
        [DllImport(Library, CallingConvention = C)] internal static extern int trephine_protection_structure_totals(Protection p, int structure, ref StructureTotals t);
        [DllImport(Library, CallingConvention = C)] internal static extern int trephine_scene_set_push(DrillScene scene, int on);

        [DllImport(Library, CallingConvention = C)] internal static extern int trephine_reader_create(BoneGrid grid, out BoneReader reader);
        [DllImport(Library, CallingConvention = C)] internal static extern void trephine_reader_destroy(IntPtr reader);
        [DllImport(Library, CallingConvention = C)] internal static extern int trephine_reader_bricks(BoneReader reader, out Int3 bricks);
        [DllImport(Library, CallingConvention = C)] internal static extern int trephine_reader_changed(BoneReader reader, [Out] int[] bricks, UIntPtr room, out UIntPtr count);
        [DllImport(Library, CallingConvention = C)] internal static extern int trephine_reader_copy(BoneReader reader, int brick, [Out] short[] voxels, UIntPtr bytes);
        [DllImport(Library, CallingConvention = C)] internal static extern int trephine_reader_copy(BoneReader reader, int brick, [Out] float[] voxels, UIntPtr bytes);

        [DllImport(Library, CallingConvention = C)] internal static extern int trephine_reader_mesh(BoneReader reader, int brick, double isovalue, MeshFlags flags, out UIntPtr vertices, out UIntPtr indices);
        [DllImport(Library, CallingConvention = C)] internal static extern int trephine_reader_copy_mesh(BoneReader reader, [Out] float[] positions, [Out] float[] normals, UIntPtr vertices, [Out] uint[] indices, UIntPtr index_room);

        [DllImport(Library, CallingConvention = C)] internal static extern int trephine_ramp_create(double duration, out ForceRamp ramp);
        [DllImport(Library, CallingConvention = C)] internal static extern void trephine_ramp_destroy(IntPtr ramp);
        [DllImport(Library, CallingConvention = C)] internal static extern int trephine_ramp_step(ForceRamp ramp, DrillScene scene, Status status, double dt, out double factor);
        [DllImport(Library, CallingConvention = C)] internal static extern int trephine_ramp_restart(ForceRamp ramp);

        [DllImport(Library, CallingConvention = C)] internal static extern int trephine_mirror_pose(ref RigidPose from, out RigidPose to);
        [DllImport(Library, CallingConvention = C)] internal static extern int trephine_mirror_force(ref Double3 from, out Double3 to);
        [DllImport(Library, CallingConvention = C)] internal static extern int trephine_mirror_torque(ref Double3 from, out Double3 to);
    }
}
