// A client of the synthesis service that knows nothing of RoboSC but its .proto files: stubs made by ts-proto, calls by
// grpc-js. It calls every method and prints what it was answered, as JSON.
//
//   node client.js ADDRESS MODEL [TOKEN]

import { createHash } from "node:crypto";
import { readFile } from "node:fs/promises";
import { basename } from "node:path";

import { type ClientReadableStream, credentials, Metadata, type ServiceError, status } from "@grpc/grpc-js";

import { ErrorInfo } from "./google/rpc/error_details.js";
import { Status } from "./google/rpc/status.js";
import { type Job, JobServiceClient, JobState } from "./robosc_api/v1/jobs.js";
import {
  type Bundle,
  type ExploreResponse,
  type GenerateResponse,
  Language,
  SynthesisServiceClient,
  type SynthesizeResponse,
  type VerifyResponse,
} from "./robosc_api/v1/synthesis.js";

const [address, model, token] = process.argv.slice(2);
if (address === undefined || model === undefined) {
  throw new Error("usage: node client.js ADDRESS MODEL [TOKEN]");
}
const synthesis = new SynthesisServiceClient(address, credentials.createInsecure());
const jobs = new JobServiceClient(address, credentials.createInsecure());
const metadata = new Metadata();
if (token !== undefined) {
  metadata.set("authorization", `Bearer ${token}`);
}
const limits = () => ({ deadline: Date.now() + 60_000 });

type Unary<Request, Response> = (
  request: Request,
  metadata: Metadata,
  options: { deadline: number },
  callback: (error: ServiceError | null, response: Response) => void,
) => unknown;

function called<Request, Response>(method: Unary<Request, Response>, request: Request): Promise<Response> {
  return new Promise((resolve, reject) =>
    method(request, metadata, limits(), (error, response) => (error ? reject(error) : resolve(response))),
  );
}

const sha256 = (content: Uint8Array) => createHash("sha256").update(content).digest("hex");
const hex = (content: Uint8Array) => Buffer.from(content).toString("hex");

function require(condition: boolean, what: string): asserts condition {
  if (!condition) {
    throw new Error(what);
  }
}

async function synthesize(bundle: Bundle) {
  const stages: string[] = [];
  const stream = synthesis.synthesize({ bundle, options: undefined, modular: false }, metadata, limits());
  for await (const message of stream as AsyncIterable<SynthesizeResponse>) {
    if (message.event?.$case === "progress") {
      stages.push(message.event.value.stage);
    } else if (message.event?.$case === "result") {
      const result = message.event.value;
      const digest = sha256(result.supervisor);
      require(digest === hex(result.supervisorDigest), "the supervisor is not what its digest says");
      return {
        stages,
        status: result.status,
        supervisor: Buffer.from(result.supervisor).toString("base64"),
        states: result.summary?.states,
      };
    }
  }
  throw new Error("the stream ended without a result");
}

async function generate(bundle: Bundle, target: string) {
  const contents: Buffer[] = [];
  let listed: { path: string; size: bigint; digest: Uint8Array; executable: boolean }[] = [];
  let digest = "";
  const stream: ClientReadableStream<GenerateResponse> = synthesis.generate(
    { bundle, options: undefined, target, generation: undefined, initial: "", modular: false },
    metadata,
    limits(),
  );
  for await (const message of stream as AsyncIterable<GenerateResponse>) {
    if (message.event?.$case === "result") {
      listed = message.event.value.files;
      digest = hex(message.event.value.digest);
      contents.push(...listed.map(() => Buffer.alloc(0)));
    } else if (message.event?.$case === "chunk") {
      const { file, offset, data } = message.event.value;
      const before = contents[file];
      require(before !== undefined && BigInt(before.length) === offset, "a piece stands in the wrong place");
      contents[file] = Buffer.concat([before, data]);
    }
  }
  const whole = createHash("sha256");
  const files: Record<string, string> = {};
  listed.forEach((file, place) => {
    const content = contents[place] ?? Buffer.alloc(0);
    require(sha256(content) === hex(file.digest) && BigInt(content.length) === file.size, `${file.path} is damaged`);
    whole.update(file.path).update(Buffer.from([0, file.executable ? 1 : 0])).update(file.digest);
    files[file.path] = content.toString("utf-8");
  });
  require(whole.digest("hex") === digest, "the files are not what their digest says");
  return files;
}

async function explore(bundle: Bundle) {
  const pieces: Uint8Array[] = [];
  let digest = "";
  const stream = synthesis.explore({ bundle, options: undefined, maximumStates: 0n }, metadata, limits());
  for await (const message of stream as AsyncIterable<ExploreResponse>) {
    if (message.event?.$case === "result") {
      digest = hex(message.event.value.digest);
    } else if (message.event?.$case === "chunk") {
      pieces.push(message.event.value);
    }
  }
  const graph = Buffer.concat(pieces);
  require(sha256(graph) === digest, "the graph is not what its digest says");
  return JSON.parse(graph.toString("utf-8"));
}

async function verify(bundle: Bundle, properties: string[]) {
  const request = { bundle, options: undefined, properties, propertyFiles: [], maximumStates: 0n, strict: false };
  const stream = synthesis.verify({ ...request, supervisor: Buffer.alloc(0) }, metadata, limits());
  for await (const message of stream as AsyncIterable<VerifyResponse>) {
    if (message.event?.$case === "result") {
      const result = message.event.value;
      return { status: result.status, report: JSON.parse(result.report) };
    }
  }
  throw new Error("the stream ended without a result");
}

async function submit(bundle: Bundle) {
  const submitted = await called(jobs.submitJob.bind(jobs) as never, {
    task: { request: { $case: "synthesize", value: { bundle, options: undefined, modular: false } } },
    idempotencyKey: "from TypeScript",
    label: "a job of another language",
    retention: undefined,
  }) as { job: Job | undefined };
  let job = submitted.job;
  require(job !== undefined, "there is no job");
  const states: string[] = [];
  for await (const message of jobs.watchJob({ id: job.id, afterRevision: 0n }, metadata, limits())) {
    job = message.job as Job;
    states.push(job.state);
  }
  require(job.state === JobState.JOB_STATE_SUCCEEDED, `the job has not succeeded: ${states}`);
  for await (const message of jobs.getJobResult({ id: job.id }, metadata, limits())) {
    const response = message.response;
    if (response?.$case === "synthesize" && response.value.event?.$case === "result") {
      const supervisor = Buffer.from(response.value.event.value.supervisor).toString("base64");
      return { states, label: job.label, mainFile: job.mainFile, supervisor };
    }
  }
  throw new Error("the job has no result");
}

function reasonOf(error: ServiceError) {
  const [details] = error.metadata.get("grpc-status-details-bin");
  const packed = Status.decode(details as Buffer).details.find(({ typeUrl }) => typeUrl.endsWith("ErrorInfo"));
  const info = packed && ErrorInfo.decode(packed.value);
  return { code: status[error.code], message: error.details, reason: info?.reason, domain: info?.domain };
}

const text = await readFile(model, "utf-8");
const bundle: Bundle = {
  main: { name: basename(model), text },
  libraries: [],
  searched: ["."],
  interfaces: [],
  language: Language.LANGUAGE_ROBOSC,
};
const wrong: Bundle = { ...bundle, main: { name: basename(model), text: "robot R {" } };
const outside: Bundle = { ...bundle, main: { name: "/etc/passwd", text } };

const version = await called(synthesis.getVersion.bind(synthesis), {});
const targets = await called(synthesis.listTargets.bind(synthesis), {});
const findings = await called(synthesis.check.bind(synthesis), { bundle: wrong });
const formatted = await called(synthesis.format.bind(synthesis), { file: { name: "x.rscd", text: "robot R{}" } });
console.log(
  JSON.stringify({
    version: version.version,
    bundleBytes: Number(version.limits?.bundleBytes),
    targets: targets.targets.map(({ name }) => name),
    findings: findings.diagnostics.map(({ code, location }) => [code, location?.line, location?.column]),
    formatted: formatted.text,
    synthesis: await synthesize(bundle),
    files: await generate(bundle, "python"),
    graph: await explore(bundle),
    verification: await verify(bundle, ["reachable true", "AG false"]),
    job: await submit(bundle),
    refusal: await called(synthesis.check.bind(synthesis), { bundle: outside }).then(() => null, reasonOf),
  }),
);
synthesis.close();
jobs.close();
