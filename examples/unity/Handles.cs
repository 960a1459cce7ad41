// SPDX-License-Identifier: MIT
using System;
using System.Runtime.InteropServices;

namespace Trephine
{
    // What the library holds for its caller. Dispose in any order; the finaliser does it for who forgets.
    public abstract class Held : SafeHandle
    {
        internal Held() : base(IntPtr.Zero, true) { }
        public override bool IsInvalid { get { return handle == IntPtr.Zero; } }
    }

    public sealed class BoneGrid : Held
    {
        BoneGrid() { }
        protected override bool ReleaseHandle() { Native.trephine_grid_destroy(handle); return true; }

        public static BoneGrid Create(GridOptions o, short[] voxels)
        {
            BoneGrid grid;
            o.density_type = 0;
            Native.Check(Native.trephine_grid_create(ref o, voxels, (UIntPtr)(2UL * (ulong)voxels.Length), out grid));
            return grid;
        }
        public static BoneGrid Create(GridOptions o, float[] voxels)
        {
            BoneGrid grid;
            o.density_type = 1;
            Native.Check(Native.trephine_grid_create(ref o, voxels, (UIntPtr)(4UL * (ulong)voxels.Length), out grid));
            return grid;
        }
        public void SetPose(RigidPose X_WG) { Native.Check(Native.trephine_grid_set_pose(this, ref X_WG)); }
        // Returns how many edited bricks are left.
        public ulong Restore(ulong most)
        {
            UIntPtr left;
            Native.Check(Native.trephine_grid_restore(this, (UIntPtr)most, out left));
            return (ulong)left;
        }
        public void Copy(short[] to) { Native.Check(Native.trephine_grid_copy(this, to, (UIntPtr)(2UL * (ulong)to.Length))); }
        public void Copy(float[] to) { Native.Check(Native.trephine_grid_copy(this, to, (UIntPtr)(4UL * (ulong)to.Length))); }
    }

    public sealed class DrillScene : Held
    {
        DrillScene() { }
        protected override bool ReleaseHandle() { Native.trephine_scene_destroy(handle); return true; }

        // `toolName` may be null: then the tool is that of the options.
        public static DrillScene Create(BoneGrid grid, SceneOptions o, string toolName = null)
        {
            DrillScene scene;
            o.tool_name = Marshal.StringToHGlobalAnsi(toolName);
            try { Native.Check(Native.trephine_scene_create(grid, ref o, out scene)); }
            finally { Marshal.FreeHGlobal(o.tool_name); }
            return scene;
        }
        public void Tick(ref RigidPose X_WT, bool spindle, double dt, ref TickResult result)
        {
            Native.Check(Native.trephine_scene_tick(this, ref X_WT, spindle ? 1 : 0, dt, ref result));
        }
        public void SetTool(string name) { Native.Check(Native.trephine_scene_set_tool(this, name)); }
        public void Reset() { Native.Check(Native.trephine_scene_reset(this)); }
        public void SetPush(bool on) { Native.Check(Native.trephine_scene_set_push(this, on ? 1 : 0)); }
        // Null takes guard and vetoes out.
        public void SetStructures(BoneStructures s)
        {
            Native.Check(s == null ? Native.trephine_scene_set_structures(this, IntPtr.Zero)
                                   : Native.trephine_scene_set_structures(this, s));
        }
        public void Exchange(Protection p) { Native.Check(Native.trephine_scene_exchange(this, p)); }
        public void Totals(int structure, ref StructureTotals t)
        {
            Native.Check(Native.trephine_scene_structure_totals(this, structure, ref t));
        }
    }

    public sealed class BoneStructures : Held
    {
        BoneStructures() { }
        protected override bool ReleaseHandle() { Native.trephine_structures_destroy(handle); return true; }

        public static BoneStructures Create(LabelsOptions o, byte[] labels)
        {
            BoneStructures s;
            Native.Check(Native.trephine_structures_create(ref o, labels, (UIntPtr)(ulong)labels.Length, out s));
            return s;
        }
        public int Count
        {
            get
            {
                int count;
                Native.Check(Native.trephine_structures_count(this, out count));
                return count;
            }
        }
        public void Set(int structure, StructureOptions o) { Native.Check(Native.trephine_structures_set(this, structure, ref o)); }
        public void SetGuard(GuardOptions o) { Native.Check(Native.trephine_structures_set_guard(this, ref o)); }
        public void SetName(int structure, string name) { Native.Check(Native.trephine_structures_set_name(this, structure, name)); }
        public string Name(int structure)
        {
            IntPtr name;
            Native.Check(Native.trephine_structures_name(this, structure, out name));
            return Marshal.PtrToStringAnsi(name);
        }
    }

    public sealed class Protection : Held
    {
        Protection() { }
        protected override bool ReleaseHandle() { Native.trephine_protection_destroy(handle); return true; }

        // Null structures: one that protects nothing.
        public static Protection Create(DrillScene scene, BoneStructures s)
        {
            Protection p;
            Native.Check(s == null ? Native.trephine_protection_create(scene, IntPtr.Zero, out p)
                                   : Native.trephine_protection_create(scene, s, out p));
            return p;
        }
        public void Totals(int structure, ref StructureTotals t)
        {
            Native.Check(Native.trephine_protection_structure_totals(this, structure, ref t));
        }
    }

    public sealed class BoneReader : Held
    {
        BoneReader() { }
        protected override bool ReleaseHandle() { Native.trephine_reader_destroy(handle); return true; }

        public static BoneReader Create(BoneGrid grid)
        {
            BoneReader reader;
            Native.Check(Native.trephine_reader_create(grid, out reader));
            return reader;
        }
        public Int3 Bricks
        {
            get
            {
                Int3 bricks;
                Native.Check(Native.trephine_reader_bricks(this, out bricks));
                return bricks;
            }
        }
        // Writes numbers of up to `most` changed bricks, and returns how many.
        public int Changed(int[] bricks, int most)
        {
            UIntPtr count;
            Native.Check(Native.trephine_reader_changed(this, bricks, (UIntPtr)(uint)Math.Min(most, bricks.Length), out count));
            return (int)(uint)count;
        }
        // 10 x 10 x 10 voxels.
        public void Copy(int brick, short[] to) { Native.Check(Native.trephine_reader_copy(this, brick, to, (UIntPtr)(2UL * (ulong)to.Length))); }
        public void Copy(int brick, float[] to) { Native.Check(Native.trephine_reader_copy(this, brick, to, (UIntPtr)(4UL * (ulong)to.Length))); }
        public void Mesh(int brick, double isovalue, MeshFlags flags, out int vertices, out int indices)
        {
            UIntPtr v, i;
            Native.Check(Native.trephine_reader_mesh(this, brick, isovalue, flags, out v, out i));
            vertices = (int)(uint)v;
            indices = (int)(uint)i;
        }
        // `normals` may be null.
        public void CopyMesh(float[] positions, float[] normals, uint[] indices)
        {
            int room = normals == null ? positions.Length : Math.Min(positions.Length, normals.Length);
            Native.Check(Native.trephine_reader_copy_mesh(this, positions, normals, (UIntPtr)(uint)(room / 3), indices,
                                                          (UIntPtr)(uint)indices.Length));
        }
    }

    public sealed class ForceRamp : Held
    {
        ForceRamp() { }
        protected override bool ReleaseHandle() { Native.trephine_ramp_destroy(handle); return true; }

        public static ForceRamp Create(double duration)
        {
            ForceRamp ramp;
            Native.Check(Native.trephine_ramp_create(duration, out ramp));
            return ramp;
        }
        public double Step(DrillScene scene, Status status, double dt)
        {
            double factor;
            Native.Check(Native.trephine_ramp_step(this, scene, status, dt, out factor));
            return factor;
        }
        public void Restart() { Native.Check(Native.trephine_ramp_restart(this)); }
    }
}
