// SPDX-License-Identifier: MIT
using System;

namespace Trephine
{
    // A brick's mesh, whose arrays may be longer than it is; they are another brick's after the call that gives them.
    public struct BrickMesh
    {
        public int brick;
        public float[] positions, normals;  // x, y, z of each vertex, in the bone's axes [m]
        public uint[] indices;
        public int vertexCount, indexCount;  // 0: no surface passes the brick any more
    }

    // Makes meshes of bricks that changed, on one thread, whichever that is, while the haptic thread drills.
    public sealed class BoneMesh : IDisposable
    {
        readonly BoneReader reader;
        readonly double isovalue;
        readonly MeshFlags flags;
        readonly int[] changed = new int[256];
        BrickMesh mesh;

        public BoneMesh(BoneGrid grid, double isovalue, MeshFlags flags = MeshFlags.Unity)
        {
            reader = BoneReader.Create(grid);
            this.isovalue = isovalue;
            this.flags = flags;
            mesh.positions = mesh.normals = new float[0];
            mesh.indices = new uint[0];
        }
        public void Dispose() { reader.Dispose(); }

        // Makes up to `most` bricks anew and gives each to `draw`; returns how many. Every brick counts as changed at
        // first. Allocates where a mesh is larger than all before.
        public int Update(int most, Action<BrickMesh> draw)
        {
            int done = 0;
            while (done < most)
            {
                int count = reader.Changed(changed, most - done);
                if (count == 0) break;
                for (int i = 0; i < count; ++i) draw(Make(changed[i]));
                done += count;
            }
            return done;
        }

        BrickMesh Make(int brick)
        {
            mesh.brick = brick;
            reader.Mesh(brick, isovalue, flags, out mesh.vertexCount, out mesh.indexCount);
            if (mesh.positions.Length < 3 * mesh.vertexCount)
            {
                mesh.positions = new float[6 * mesh.vertexCount];
                mesh.normals = new float[6 * mesh.vertexCount];
            }
            if (mesh.indices.Length < mesh.indexCount) mesh.indices = new uint[2 * mesh.indexCount];
            reader.CopyMesh(mesh.positions, mesh.normals, mesh.indices);
            return mesh;
        }
    }
}
