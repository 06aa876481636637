function accept_export(file, run, Ts)
% ACCEPT_EXPORT  Write a run of the rig as vectors that `accept` reads.
%
%   accept_export(FILE, RUN)      RUN: a Simulink.SimulationOutput, a Dataset, a timeseries, a timetable, or a
%                                 structure of these, as a Speedgoat File Log is after import
%   accept_export(FILE, RUN, Ts)  with the sampling time Ts [s], if the signals have no time of their own
%
% Every signal becomes a vector of its own name, the time the vector t [s]. Signals of another time axis than the first
% are refused: they are no samples of the same instants.

s = struct();
s = collect(s, '', run);
names = fieldnames(s);
if isempty(names), error('accept_export: no signal in the run'); end
out = struct();
for k = 1:numel(names)
    [t, x] = deal(s.(names{k}).t, s.(names{k}).x);
    if isempty(t)
        if nargin < 3, error('accept_export: %s has no time; give Ts', names{k}); end
        t = Ts * (0:numel(x) - 1)';
    end
    if ~isfield(out, 't'), out.t = t(:); end
    if numel(t) ~= numel(out.t) || any(abs(t(:) - out.t) > 1e-9 * max(1, abs(out.t(end))))
        error('accept_export: %s has another time axis than %s', names{k}, names{1});
    end
    out.(names{k}) = double(x(:));
end
save(file, '-struct', 'out', '-v7');
end

function s = collect(s, name, value)
if isa(value, 'Simulink.SimulationOutput')
    for one = value.who', s = collect(s, one{1}, value.get(one{1})); end
elseif isa(value, 'Simulink.SimulationData.Dataset')
    for k = 1:value.numElements
        element = value.getElement(k);
        s = collect(s, element.Name, element.Values);
    end
elseif isa(value, 'timeseries')
    if isempty(name), name = value.Name; end
    s = add(s, name, value.Time, squeeze(value.Data));
elseif isa(value, 'timetable')
    for one = value.Properties.VariableNames
        s = add(s, one{1}, seconds(value.Properties.RowTimes - value.Properties.RowTimes(1)), value.(one{1}));
    end
elseif isstruct(value) && isscalar(value)
    for one = fieldnames(value)', s = collect(s, one{1}, value.(one{1})); end
elseif isnumeric(value) && isvector(value) && numel(value) > 1
    s = add(s, name, [], value);
end
end

function s = add(s, name, t, x)
x = double(x);
if size(x, 1) ~= numel(t) && ~isempty(t) && size(x, 2) == numel(t), x = x.'; end
for k = 1:max(1, size(x, 2) * ~isvector(x))
    label = matlab.lang.makeValidName(name);
    if ~isvector(x), label = sprintf('%s_%d', label, k); column = x(:, k); else, column = x(:); end
    if isfield(s, label), error('accept_export: two signals are called %s', label); end
    s.(label) = struct('t', t(:), 'x', column);
end
end
