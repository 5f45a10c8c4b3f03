// SPDX-License-Identifier: GPL-3.0-or-later
//
// A job type for Flamenco, the render manager of Blender studios: a command of OMT UV over a folder of meshes.
// Put this file into the folder "scripts" next to flamenco-manager. Every worker needs the extension OMT UV and sees
// the folders under the same paths, or by variables of Flamenco.
//
// The manager cannot look into folders, so a task is a part of the files: part K of N goes by a hash of each name. It
// keeps a manifest of its own beside the results, and a task that is run again goes on where it was. The last task
// writes one table and one page of all parts.

const JOB_TYPE = {
    label: "OMT UV Batch",
    description: "Unwrap, remesh or measure every mesh of a folder",
    settings: [
        { key: "command", type: "string", required: true, default: "unwrap",
          choices: ["unwrap", "refine", "remesh", "sphere", "measure"], visible: "submission",
          description: "What is done to every file" },
        { key: "input", type: "string", subtype: "dir_path", required: true, visible: "submission",
          description: "Folder of the meshes, with the folders in it" },
        { key: "output", type: "string", subtype: "dir_path", required: true, visible: "submission",
          description: "Folder of the results" },
        { key: "options", type: "string", default: "", visible: "submission",
          description: "Options of the command, as on the command line: --quality draft" },
        { key: "parts", type: "int32", default: 8, propargs: {min: 1, max: 10000}, visible: "submission",
          description: "Tasks that the files are split into; several for each worker" },
        { key: "jobs", type: "int32", default: 0, propargs: {min: 0, max: 256}, visible: "submission",
          description: "Files at a time on one worker; 0: one for each core" },
        { key: "timeout", type: "int32", default: 3600, propargs: {min: 0}, visible: "submission",
          description: "Seconds after which a file is given up; 0: never" },
    ]
};

function compileJob(job) {
    const settings = job.settings;
    const parts = Math.max(1, settings.parts || 1);
    const last = author.Task("table and page", "blender");
    for (let k = 1; k <= parts; k++) {
        const task = author.Task(`part ${k} of ${parts}`, "blender");
        task.addCommand(blender(batchWords(settings, k, parts)));
        job.addTask(task);
        last.addDependency(task);
    }
    last.addCommand(blender(["table", settings.output, "-o", settings.output.replace(/[\/\\]+$/, "") + ".csv"]));
    last.addCommand(blender(["page", settings.output]));
    job.addTask(last);
}

// Words of the command line for part k of n. None of them goes through a shell.
function batchWords(settings, k, n) {
    const words = ["batch", settings.command, settings.input, "-o", settings.output, "--part", `${k}/${n}`, "--allow-failures"];
    if (settings.jobs > 0) {
        words.push("--jobs", String(settings.jobs));
    }
    if (settings.timeout > 0) {
        words.push("--timeout", String(settings.timeout));
    }
    const options = splitWords(settings.options || "");
    return options.length ? words.concat(["--"], options) : words;
}

// A Blender without a window that runs the command of the extension.
function blender(words) {
    return author.Command("exec", {
        exe: "{blender}",
        args: ["-b", "--command", "omt_uv"].concat(words),
    });
}

// The words of a text; blanks within quotes belong to a word.
function splitWords(text) {
    const words = [];
    const pattern = /"([^"]*)"|'([^']*)'|(\S+)/g;
    let found;
    while ((found = pattern.exec(text)) !== null) {
        words.push(found[1] !== undefined ? found[1] : found[2] !== undefined ? found[2] : found[3]);
    }
    return words;
}
