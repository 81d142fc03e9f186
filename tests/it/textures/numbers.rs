//! Rays, what they meet, and uv, dp_du and dp_dv there as Mitsuba 3.9.1 (scalar_rgb) has them.

/// A shape, a ray's origin and direction, and u, v, 0; ∂p/∂u; ∂p/∂v.
pub(super) type Row = (&'static str, [f32; 3], [f32; 3], [[f32; 3]; 3]);

pub(super) const PARAMETERIZATIONS: &[Row] = &[
    (
        "<shape type='rectangle'></shape>",
        [1.5, 0.9, 4.0],
        [-1.2, -0.7, -3.9],
        [[0.634615, 0.591026, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]],
    ),
    (
        "<shape type='cube'></shape>",
        [1.5, 0.9, 4.0],
        [-1.2, -0.7, -3.9],
        [[0.680769, 0.788462, 0.0], [-0.0, 2.0, 0.0], [2.0, -0.0, -0.0]],
    ),
    (
        "<shape type='sphere'><point name='center' x='0.2' y='0.1' z='-0.3'/><float name='radius' value='0.7'/></shape>",
        [1.5, 0.9, 4.0],
        [-1.2, -0.7, -3.9],
        [[0.108803, 0.107677, 0.0], [-0.921905, 1.131611, 0.0], [1.608317, 1.31027, -0.729803]],
    ),
    (
        "<shape type='disk'></shape>",
        [1.5, 0.9, 4.0],
        [-1.2, -0.7, -3.9],
        [[0.325004, 0.094628, 0.0], [0.828391, 0.56015, 0.0], [-1.143862, 1.691627, 0.0]],
    ),
    (
        "<shape type='cylinder'><point name='p0' x='0.1' y='0.2' z='-1'/><point name='p1' x='0.5' y='0.3' z='1.2'/><float name='radius' value='0.6'/></shape>",
        [3.0, 2.5, 0.4],
        [-2.7, -2.3, -0.3],
        [[0.104538, 0.571009, 0.0], [-2.276892, 2.991774, 0.277991], [0.4, 0.1, 2.2]],
    ),
    (
        "<shape type='rectangle'><boolean name='flip_normals' value='true'/></shape>",
        [1.5, 0.9, 4.0],
        [-1.2, -0.7, -3.9],
        [[0.634615, 0.591026, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]],
    ),
    (
        "<shape type='cube'><boolean name='flip_normals' value='true'/></shape>",
        [1.5, 0.9, 4.0],
        [-1.2, -0.7, -3.9],
        [[0.680769, 0.788462, 0.0], [-0.0, 2.0, 0.0], [2.0, -0.0, -0.0]],
    ),
    (
        "<shape type='sphere'><point name='center' x='0.2' y='0.1' z='-0.3'/><float name='radius' value='0.7'/><boolean name='flip_normals' value='true'/></shape>",
        [1.5, 0.9, 4.0],
        [-1.2, -0.7, -3.9],
        [[0.108803, 0.107677, 0.0], [-0.921905, 1.131611, 0.0], [1.608317, 1.31027, -0.729803]],
    ),
    (
        "<shape type='disk'><boolean name='flip_normals' value='true'/></shape>",
        [1.5, 0.9, 4.0],
        [-1.2, -0.7, -3.9],
        [[0.325004, 0.094628, 0.0], [0.828391, 0.56015, 0.0], [-1.143862, 1.691627, 0.0]],
    ),
    (
        "<shape type='cylinder'><point name='p0' x='0.1' y='0.2' z='-1'/><point name='p1' x='0.5' y='0.3' z='1.2'/><float name='radius' value='0.6'/><boolean name='flip_normals' value='true'/></shape>",
        [3.0, 2.5, 0.4],
        [-2.7, -2.3, -0.3],
        [[0.104538, 0.571009, 0.0], [-2.276892, 2.991774, 0.277991], [0.4, 0.1, 2.2]],
    ),
    (
        "<shape type='rectangle'><transform name='to_world'><rotate x='0.6' y='0' z='0.8' angle='40'/><scale value='2'/><translate x='1' y='2' z='3'/></transform></shape>",
        [-2.7912, -0.9171, 9.4434],
        [4.1181, 3.4549, -6.0386],
        [[0.685929, 0.585937, 0.0], [3.401073, 2.05692, 0.449195], [-2.05692, 3.064178, 1.54269]],
    ),
    (
        "<shape type='cube'><transform name='to_world'><rotate x='0.6' y='0' z='0.8' angle='40'/><scale value='2'/><translate x='1' y='2' z='3'/></transform></shape>",
        [-2.7912, -0.9171, 9.4434],
        [4.1181, 3.4549, -6.0386],
        [[0.726559, 0.326556, 0.0], [-2.05692, 3.064178, 1.54269], [3.401074, 2.05692, 0.449195]],
    ),
    (
        "<shape type='sphere'><point name='center' x='0.2' y='0.1' z='-0.3'/><float name='radius' value='0.7'/><transform name='to_world'><rotate x='0.6' y='0' z='0.8' angle='40'/><scale value='2'/><translate x='1' y='2' z='3'/></transform></shape>",
        [-2.7912, -0.9171, 9.4434],
        [4.1181, 3.4549, -6.0386],
        [[0.328481, 0.092227, 0.0], [-1.270537, -2.049715, -0.707421], [-3.746784, 2.302776, 0.057099]],
    ),
    (
        "<shape type='disk'><transform name='to_world'><rotate x='0.6' y='0' z='0.8' angle='40'/><scale value='2'/><translate x='1' y='2' z='3'/></transform></shape>",
        [-2.7912, -0.9171, 9.4434],
        [4.1181, 3.4549, -6.0386],
        [[0.409657, 0.068907, 0.0], [1.112131, 1.57636, 0.527496], [-4.239381, 2.469, 1.559663]],
    ),
    (
        "<shape type='cylinder'><point name='p0' x='0.1' y='0.2' z='-1'/><point name='p1' x='0.5' y='0.3' z='1.2'/><float name='radius' value='0.6'/><transform name='to_world'><rotate x='0.6' y='0' z='0.8' angle='40'/><scale value='2'/><translate x='1' y='2' z='3'/></transform></shape>",
        [-2.7912, -0.9171, 9.4434],
        [4.1181, 3.4549, -6.0386],
        [[0.470876, 0.756722, 0.0], [2.748075, -6.570601, -2.47471], [1.071483, -1.132366, 4.196388]],
    ),
    (
        "<shape type='rectangle'><transform name='to_world'><scale x='-1'/><rotate x='0.6' y='0' z='0.8' angle='40'/><scale value='2'/><translate x='1' y='2' z='3'/></transform></shape>",
        [-1.578, -1.2492, 10.6835],
        [1.8846, 3.1699, -7.4135],
        [[0.634626, 0.591014, 0.0], [-3.401073, -2.05692, -0.449195], [-2.05692, 3.064178, 1.54269]],
    ),
    (
        "<shape type='cube'><transform name='to_world'><scale x='-1'/><rotate x='0.6' y='0' z='0.8' angle='40'/><scale value='2'/><translate x='1' y='2' z='3'/></transform></shape>",
        [-1.578, -1.2492, 10.6835],
        [1.8846, 3.1699, -7.4135],
        [[0.680759, 0.788469, 0.0], [-2.05692, 3.064178, 1.54269], [-3.401073, -2.05692, -0.449195]],
    ),
    (
        "<shape type='sphere'><point name='center' x='0.2' y='0.1' z='-0.3'/><float name='radius' value='0.7'/><transform name='to_world'><scale x='-1'/><rotate x='0.6' y='0' z='0.8' angle='40'/><scale value='2'/><translate x='1' y='2' z='3'/></transform></shape>",
        [-1.578, -1.2492, 10.6835],
        [1.8846, 3.1699, -7.4135],
        [[0.108784, 0.107677, 0.0], [0.403567, 2.681911, 1.07998], [-4.246545, 0.915827, -0.687419]],
    ),
    (
        "<shape type='disk'><transform name='to_world'><scale x='-1'/><rotate x='0.6' y='0' z='0.8' angle='40'/><scale value='2'/><translate x='1' y='2' z='3'/></transform></shape>",
        [-1.578, -1.2492, 10.6835],
        [1.8846, 3.1699, -7.4135],
        [[0.32501, 0.094613, 0.0], [-1.984811, 0.00606, 0.245943], [0.205032, 3.7682, 1.561808]],
    ),
    (
        "<shape type='cylinder'><point name='p0' x='0.1' y='0.2' z='-1'/><point name='p1' x='0.5' y='0.3' z='1.2'/><float name='radius' value='0.6'/><transform name='to_world'><scale x='-1'/><rotate x='0.6' y='0' z='0.8' angle='40'/><scale value='2'/><translate x='1' y='2' z='3'/></transform></shape>",
        [-6.5829, 2.4363, 4.9872],
        [6.8895, -0.5156, -1.7171],
        [[0.104536, 0.571022, 0.0], [0.857375, 6.710942, 3.328229], [-0.288947, -1.955135, 4.01671]],
    ),
    (
        "<shape type='rectangle'><boolean name='flip_normals' value='true'/><transform name='to_world'><scale x='-1'/><rotate x='0.6' y='0' z='0.8' angle='40'/><scale value='2'/><translate x='1' y='2' z='3'/></transform></shape>",
        [-1.578, -1.2492, 10.6835],
        [1.8846, 3.1699, -7.4135],
        [[0.634626, 0.591014, 0.0], [-3.401073, -2.05692, -0.449195], [-2.05692, 3.064178, 1.54269]],
    ),
    (
        "<shape type='cube'><boolean name='flip_normals' value='true'/><transform name='to_world'><scale x='-1'/><rotate x='0.6' y='0' z='0.8' angle='40'/><scale value='2'/><translate x='1' y='2' z='3'/></transform></shape>",
        [-1.578, -1.2492, 10.6835],
        [1.8846, 3.1699, -7.4135],
        [[0.680759, 0.788469, 0.0], [-2.05692, 3.064178, 1.54269], [-3.401073, -2.05692, -0.449195]],
    ),
    (
        "<shape type='sphere'><point name='center' x='0.2' y='0.1' z='-0.3'/><float name='radius' value='0.7'/><boolean name='flip_normals' value='true'/><transform name='to_world'><scale x='-1'/><rotate x='0.6' y='0' z='0.8' angle='40'/><scale value='2'/><translate x='1' y='2' z='3'/></transform></shape>",
        [-1.578, -1.2492, 10.6835],
        [1.8846, 3.1699, -7.4135],
        [[0.108784, 0.107677, 0.0], [0.403567, 2.681911, 1.07998], [-4.246545, 0.915827, -0.687419]],
    ),
    (
        "<shape type='disk'><boolean name='flip_normals' value='true'/><transform name='to_world'><scale x='-1'/><rotate x='0.6' y='0' z='0.8' angle='40'/><scale value='2'/><translate x='1' y='2' z='3'/></transform></shape>",
        [-1.578, -1.2492, 10.6835],
        [1.8846, 3.1699, -7.4135],
        [[0.32501, 0.094613, 0.0], [-1.984811, 0.00606, 0.245943], [0.205033, 3.768201, 1.561809]],
    ),
    (
        "<shape type='cylinder'><point name='p0' x='0.1' y='0.2' z='-1'/><point name='p1' x='0.5' y='0.3' z='1.2'/><float name='radius' value='0.6'/><boolean name='flip_normals' value='true'/><transform name='to_world'><scale x='-1'/><rotate x='0.6' y='0' z='0.8' angle='40'/><scale value='2'/><translate x='1' y='2' z='3'/></transform></shape>",
        [-6.5829, 2.4363, 4.9872],
        [6.8895, -0.5156, -1.7171],
        [[0.104536, 0.571022, 0.0], [0.857375, 6.710942, 3.328229], [-0.288947, -1.955135, 4.01671]],
    ),
    (
        "<shape type='cube'/>",
        [3.0, -0.2, 0.1],
        [-1.0, 0.0, 0.0],
        [[0.4, 0.45, 0.0], [-0.0, 2.0, 0.0], [-0.0, -0.0, -2.0]],
    ),
    (
        "<shape type='cube'/>",
        [-3.0, -0.2, 0.1],
        [1.0, 0.0, 0.0],
        [[0.4, 0.55, 0.0], [-0.0, 2.0, -0.0], [-0.0, -0.0, 2.0]],
    ),
    (
        "<shape type='cube'/>",
        [0.3, 3.0, 0.1],
        [0.0, -1.0, 0.0],
        [[0.35, 0.45, 0.0], [-2.0, -0.0, 0.0], [0.0, -0.0, -2.0]],
    ),
    (
        "<shape type='cube'/>",
        [0.3, -3.0, 0.1],
        [0.0, 1.0, 0.0],
        [[0.55, 0.65, 0.0], [-0.0, 0.0, 2.0], [2.0, -0.0, -0.0]],
    ),
    (
        "<shape type='cube'/>",
        [0.3, -0.2, 3.0],
        [0.0, 0.0, -1.0],
        [[0.4, 0.65, 0.0], [-0.0, 2.0, 0.0], [2.0, -0.0, -0.0]],
    ),
    (
        "<shape type='cube'/>",
        [0.3, -0.2, -3.0],
        [0.0, 0.0, 1.0],
        [[0.6, 0.65, 0.0], [-0.0, -2.0, 0.0], [2.0, -0.0, -0.0]],
    ),
];
