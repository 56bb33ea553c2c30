'use strict';
(() => {
    const $ = id => document.getElementById(id);
    const facts = JSON.parse($('facts').textContent);
    const canvas = $('canvas'), stage = $('stage'), form = $('controls'), field = form.elements;
    const kinds = ['lit', 'diffuse', 'specular', 'roughness', 'normal', 'photo']; // numbered as in the shader
    const preview = location.hash === '#preview';
    let gl, program, uniform, texture, place, waiting = false, dragged = null;

    function fail(why) {
        $('notice').textContent = why + ' Here are the pictures alone.';
        $('notice').hidden = false;
        $('tool').hidden = $('hint').hidden = true;
        $('still').style.display = 'block';
    }

    /* The graphics. */

    function link(fragment) {
        const vertex = '#version 300 es\nvoid main() {\n' +
            'gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0, 0.0, 1.0); }';
        const p = gl.createProgram();
        for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
            const shader = gl.createShader(kind);
            gl.shaderSource(shader, source);
            gl.compileShader(shader);
            gl.attachShader(p, shader);
            if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS) && !gl.isContextLost())
                throw new Error(gl.getShaderInfoLog(shader));
        }
        gl.linkProgram(p);
        if (!gl.getProgramParameter(p, gl.LINK_STATUS) && !gl.isContextLost()) throw new Error(gl.getProgramInfoLog(p));
        return p;
    }

    function textureOf(format, image, filtered) {
        const t = gl.createTexture();
        gl.bindTexture(gl.TEXTURE_2D, t);
        if (image) gl.texImage2D(gl.TEXTURE_2D, 0, format, gl.RGBA, gl.UNSIGNED_BYTE, image);
        else gl.texStorage2D(gl.TEXTURE_2D, 1 + Math.floor(Math.log2(facts.size)), format, facts.size, facts.size);
        const wrap = filtered ? facts.repeats ? gl.REPEAT : gl.MIRRORED_REPEAT : gl.CLAMP_TO_EDGE;
        gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, wrap);
        gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_T, wrap);
        gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, filtered ? gl.LINEAR : gl.NEAREST);
        gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, filtered ? gl.LINEAR_MIPMAP_LINEAR : gl.NEAREST);
        if (filtered && image) gl.generateMipmap(gl.TEXTURE_2D);
        return t;
    }

    /* Normals and roughness have 16 bits, of which a browser keeps 8: they come as two pictures. */
    function joinBytes() {
        const join = link('#version 300 es\nprecision highp float;\nuniform sampler2D high, low;\nout vec4 v;\n' +
            'void main() {\nivec2 at = ivec2(gl_FragCoord.xy);\n' +
            'vec3 whole = (texelFetch(high, at, 0).rgb * 256.0 + texelFetch(low, at, 0).rgb) / 257.0;\n' +
            'v = vec4(whole.xy * 2.0 - 1.0, whole.z, 1.0); }');
        const high = textureOf(gl.RGBA8, $('high'), false), low = textureOf(gl.RGBA8, $('low'), false);
        const joined = textureOf(gl.RGBA16F, null, true), frame = gl.createFramebuffer();
        gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
        gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, joined, 0);
        if (gl.checkFramebufferStatus(gl.FRAMEBUFFER) !== gl.FRAMEBUFFER_COMPLETE && !gl.isContextLost())
            throw new Error('no float textures');
        gl.useProgram(join);
        [high, low].forEach((t, i) => {
            gl.activeTexture(gl.TEXTURE0 + i);
            gl.bindTexture(gl.TEXTURE_2D, t);
        });
        gl.uniform1i(gl.getUniformLocation(join, 'high'), 0);
        gl.uniform1i(gl.getUniformLocation(join, 'low'), 1);
        gl.viewport(0, 0, facts.size, facts.size);
        gl.drawArrays(gl.TRIANGLES, 0, 3);
        gl.bindFramebuffer(gl.FRAMEBUFFER, null);
        gl.deleteFramebuffer(frame);
        gl.deleteTexture(high);
        gl.deleteTexture(low);
        gl.deleteProgram(join);
        gl.activeTexture(gl.TEXTURE0);
        gl.bindTexture(gl.TEXTURE_2D, joined);
        gl.generateMipmap(gl.TEXTURE_2D);
        return joined;
    }

    function prepare() {
        if (!gl.getExtension('EXT_color_buffer_float') && !gl.getExtension('EXT_color_buffer_half_float'))
            throw new Error('no float textures');
        gl.pixelStorei(gl.UNPACK_COLORSPACE_CONVERSION_WEBGL, gl.NONE);
        gl.pixelStorei(gl.UNPACK_PREMULTIPLY_ALPHA_WEBGL, false);
        gl.disable(gl.DITHER);
        texture = {
            detailMap: joinBytes(),
            diffuseMap: textureOf(gl.SRGB8_ALPHA8, $('diffuse'), true),
            specularMap: textureOf(gl.SRGB8_ALPHA8, $('specular'), true),
            photoMap: textureOf(gl.RGBA8, $('photo'), true)
        };
        program = link($('shader').textContent);
        gl.useProgram(program);
        uniform = {};
        for (let i = gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS) - 1; i >= 0; i--) {
            const name = gl.getActiveUniform(program, i).name;
            uniform[name] = gl.getUniformLocation(program, name);
        }
        Object.keys(texture).forEach((name, i) => {
            gl.activeTexture(gl.TEXTURE0 + i);
            gl.bindTexture(gl.TEXTURE_2D, texture[name]);
            gl.uniform1i(uniform[name], i);
        });
        gl.uniform3fv(uniform.guards, facts.guards);
        gl.uniform1i(uniform.repeats, facts.repeats);
    }

    /* Of a sphere only the front would be lit from near: the light is three times as far away and as bright as if it
       were not. On the sphere's rim the pointer lights it from 50 degrees aside. */
    function aroundSphere(light, power) {
        const beside = Math.hypot(light[0], light[1]), far = facts.radius + 3 * light[2];
        const angle = Math.min(beside / facts.radius * 50, 85) * Math.PI / 180;
        const scale = far * Math.sin(angle) / (beside || 1);
        return [[light[0] * scale, light[1] * scale, far * Math.cos(angle)], 9 * power];
    }

    /* What is in the form, as the shader has it; panel: of the canvas. */
    function draw(panel, light, power, camera, shown) {
        const sphere = field.shape.value === 'sphere';
        gl.viewport(...panel);
        gl.uniform4fv(uniform.panel, panel);
        gl.uniform1i(uniform.sphere, sphere);
        if (sphere) [light, power] = aroundSphere(light, power);
        gl.uniform3fv(uniform.lightPlace, light);
        gl.uniform1f(uniform.radius, facts.radius);
        gl.uniform3fv(uniform.cameraPlace, sphere ? [0, 0, 100] : camera);
        gl.uniform1f(uniform.power, power * 2 ** Number(field.stops.value));
        gl.uniform1f(uniform.ambient, Number(field.ambient.value) + shown.ambient);
        gl.uniform1f(uniform.roughnessFactor, Number(field.roughness.value));
        gl.uniform1f(uniform.relief, Number(field.relief.value));
        gl.uniform1f(uniform.split, shown.split);
        gl.uniform1i(uniform.leftKind, kinds.indexOf(shown.left));
        gl.uniform1i(uniform.rightKind, kinds.indexOf(shown.right));
        gl.drawArrays(gl.TRIANGLES, 0, 3);
    }

    function drawPreview() {
        canvas.width = facts.lights.length * facts.size;
        canvas.height = facts.size;
        stage.style.width = canvas.width / devicePixelRatio + 'px';
        stage.style.height = canvas.height / devicePixelRatio + 'px';
        facts.lights.forEach((light, i) => draw([i * facts.size, 0, facts.size, facts.size], light, facts.power,
            facts.camera, { split: 0, left: 'lit', right: 'lit', ambient: 0 }));
    }

    function drawStage() {
        const side = Math.max(1, Math.round(stage.clientWidth * Math.min(devicePixelRatio, 2)));
        if (canvas.width !== side || canvas.height !== side) canvas.width = canvas.height = side;
        const other = field.other.value;
        const asTaken = place.preset === 'flash', camera = asTaken ? facts.flashCamera : facts.camera;
        draw([0, 0, side, side], [place.x, place.y, place.z], place.power, camera,
            { split: other ? Number(field.split.value) : 0, left: other || 'lit', right: field.show.value,
                ambient: asTaken ? facts.flashAmbient : 0 });
    }

    function redraw() {
        if (waiting || !gl) return;
        waiting = true;
        requestAnimationFrame(() => {
            waiting = false;
            if (!gl.isContextLost()) (preview ? drawPreview : drawStage)();
        });
    }

    /* The form. */

    const nameOf = kind => [...field.show.options].find(o => o.value === kind).text;
    const spoken = {
        split: v => Math.round(v * 100) + '%',
        height: v => v.toFixed(2),
        stops: v => (v > 0 ? '+' : '') + v.toFixed(1),
        ambient: v => Math.round(v * 100) + '%',
        roughness: v => '\u00d7' + v.toFixed(2),
        relief: v => '\u00d7' + v.toFixed(2)
    };

    function update() {
        const other = field.other.value, split = Number(field.split.value);
        field.height.value = place.z;
        for (const name in spoken) field[name].nextElementSibling.textContent = spoken[name](Number(field[name].value));
        field.split.disabled = !other;
        $('seam').hidden = !other;
        $('seam').style.left = split * 100 + '%';
        $('leftLabel').textContent = other ? nameOf(other) : '';
        $('rightLabel').textContent = other || field.show.value !== 'lit' ? nameOf(field.show.value) : '';
        const lamp = $('lamp'), inside = v => Math.min(0.985, Math.max(0.015, v));
        lamp.style.left = inside(place.x + 0.5) * 100 + '%';
        lamp.style.top = inside(0.5 - place.y) * 100 + '%';
        lamp.classList.toggle('held', !field.follow.checked);
        for (const b of $('lights').children) b.setAttribute('aria-pressed', b.dataset.light === place.preset);
        redraw();
    }

    /* The same lamp, elsewhere. */
    function moveTo(x, y, z) {
        const within = (v, low, high) => Math.min(high, Math.max(low, v));
        place = { x: within(x, -1, 1), y: within(y, -1, 1), power: place.power,
            z: within(z, Number(field.height.min), Number(field.height.max)) };
        update();
    }

    function atStart() {
        place = { x: 0.3, y: 0.3, z: facts.lights[0][2], power: facts.power };
        update();
    }

    function choose(which) {
        const flash = which === 'flash', [x, y, z] = flash ? facts.flash : facts.lights[Number(which)];
        field.follow.checked = false;
        place = { x, y, z, preset: which, power: flash ? facts.flashPower : facts.power };
        update();
    }

    /* Pointer and keys. */

    function where(event) {
        const box = canvas.getBoundingClientRect();
        return [(event.clientX - box.left) / box.width - 0.5, 0.5 - (event.clientY - box.top) / box.height];
    }

    const atSeam = (event, reach) => field.other.value &&
        Math.abs(where(event)[0] + 0.5 - Number(field.split.value)) * canvas.clientWidth < reach;

    function dragSeam(event) {
        field.split.value = where(event)[0] + 0.5;
        update();
    }

    canvas.addEventListener('pointerdown', event => {
        if (event.button !== 0) return;
        const mouse = event.pointerType === 'mouse';
        dragged = atSeam(event, mouse ? 10 : 24) ? 'seam' : 'light';
        canvas.setPointerCapture(event.pointerId);
        if (dragged === 'seam') return dragSeam(event);
        if (mouse) field.follow.checked = !field.follow.checked;
        moveTo(...where(event), place.z);
    });
    canvas.addEventListener('pointermove', event => {
        const mouse = event.pointerType === 'mouse';
        canvas.classList.toggle('seam', dragged === 'seam' || mouse && !dragged && Boolean(atSeam(event, 10)));
        if (dragged === 'seam') dragSeam(event);
        else if (dragged && !mouse || mouse && field.follow.checked && !canvas.classList.contains('seam'))
            moveTo(...where(event), place.z);
    });
    for (const end of ['pointerup', 'pointercancel']) canvas.addEventListener(end, () => { dragged = null; });

    canvas.addEventListener('keydown', event => {
        if (event.ctrlKey || event.altKey || event.metaKey) return;
        const step = event.shiftKey ? 0.1 : 0.02;
        const way = {
            ArrowLeft: [-step, 0], ArrowRight: [step, 0], ArrowUp: [0, step], ArrowDown: [0, -step]
        }[event.key];
        const lift = { '+': step, '=': step, PageUp: step, '-': -step, _: -step, PageDown: -step }[event.key];
        if (way) moveTo(place.x + way[0], place.y + way[1], place.z);
        else if (lift) moveTo(place.x, place.y, place.z + lift);
        else if (event.key === ' ') field.follow.checked = !field.follow.checked, update();
        else return;
        event.preventDefault();
    });

    form.addEventListener('input', event => {
        if (event.target.name === 'height') moveTo(place.x, place.y, Number(field.height.value));
        else update();
    });
    form.addEventListener('submit', event => event.preventDefault());
    form.addEventListener('reset', () => setTimeout(atStart)); // after the fields
    $('lights').addEventListener('click', event => event.target.dataset.light && choose(event.target.dataset.light));

    /* The beginning, and again when the browser has taken the graphics away. */

    function start() {
        try {
            prepare();
        } catch (error) {
            gl = null;
            fail('The material cannot be lit here: this browser\u2019s WebGL refuses (' + error.message + ').');
            return;
        }
        if (!place) atStart();
        redraw();
        document.body.dataset.ready = 'yes';
    }

    canvas.addEventListener('webglcontextlost', event => event.preventDefault());
    canvas.addEventListener('webglcontextrestored', start);
    document.body.classList.toggle('preview', preview);
    field.height.max = Math.max(2, Math.ceil(1.2 * facts.flash[2])); // of a long lens it is far away
    gl = canvas.getContext('webgl2', { alpha: false, antialias: false, depth: false });
    if (!gl) fail('The material cannot be lit here: this browser has no WebGL 2, or it is turned off.');
    else
        Promise.all(['photo', 'diffuse', 'specular', 'high', 'low'].map(id => $(id).decode())).then(() => {
            start();
            new ResizeObserver(redraw).observe(stage);
        }, () => fail('A picture in this page is damaged.'));
})();
