
-- What stands above is data; from here on it is read.

local MOST = 147 -- bytes of a frame without COBS
local HEADER, TAG, CHECK = 10, 8, 4

local proto = Proto("uav_relay", "UAV relay")
local all = {}

local function keep(made)
    all[#all + 1] = made
    return made
end

local head = {
    version = keep(ProtoField.uint8("uav_relay.version", "version")),
    sender = keep(ProtoField.uint16("uav_relay.sender", "sender")),
    flags = keep(ProtoField.uint8("uav_relay.flags", "flags", base.HEX)),
    destination = keep(ProtoField.uint16("uav_relay.destination", "destination")),
    network = keep(ProtoField.uint16("uav_relay.network", "network")),
    counter = keep(ProtoField.uint32("uav_relay.counter", "counter")),
    tag = keep(ProtoField.bytes("uav_relay.tag", "tag")),
    crc = keep(ProtoField.uint32("uav_relay.crc", "CRC", base.HEX)),
    message = keep(ProtoField.string("uav_relay.message", "message")),
    refused = keep(ProtoField.string("uav_relay.refused", "refused")),
}
local wrong = ProtoExpert.new("uav_relay.wrong", "The frame is refused", expert.group.MALFORMED, expert.severity.ERROR)
proto.experts = { wrong }

-- Bytes and constructor of each type of a fixed size.
local plain = {
    u8 = { 1, ProtoField.uint8 },
    u16 = { 2, ProtoField.uint16 },
    u32 = { 4, ProtoField.uint32 },
    u64 = { 8, ProtoField.uint64 },
    i24 = { 3, ProtoField.int24 },
    i32 = { 4, ProtoField.int32 },
    f32 = { 4, ProtoField.float },
    f64 = { 8, ProtoField.double },
    bool = { 1, ProtoField.uint8 },
    digest = { 2, ProtoField.uint16, base.HEX },
    view = { 4, ProtoField.uint32 },
    flags = { 1, ProtoField.uint8, base.HEX },
    words = { 1, ProtoField.uint8 },
}
local yes = { [0] = "no", [1] = "yes" }

-- Makes what Wireshark needs of a field, and of those within it.
local function declare(abbreviation, field)
    local kind = field.kind
    if kind == "group" then
        for _, inner in ipairs(field.fields) do
            declare(abbreviation .. "." .. inner.name, inner)
        end
        return
    end
    if kind == "option" or kind == "array" or kind == "list" then
        if kind == "list" then
            field.count = keep(ProtoField.uint8(abbreviation .. "_count", field.name .. "_count"))
        end
        field.of.name, field.of.text, field.of.unit = field.name, field.text, field.unit
        declare(abbreviation, field.of)
        return
    end
    local make, display = plain[kind][2], plain[kind][3]
    if kind == "f32" or kind == "f64" then
        field.made = keep(make(abbreviation, field.name, field.text))
    elseif kind == "words" or kind == "bool" then
        field.made = keep(make(abbreviation, field.name, base.DEC, kind == "bool" and yes or field.words, nil, field.text))
    else
        field.made = keep(make(abbreviation, field.name, display or base.DEC, nil, nil, field.text))
    end
    if kind == "flags" then
        field.bits = {}
        for bit, name in ipairs(field.words) do
            local mask = 2 ^ (bit - 1)
            field.bits[bit] = keep(ProtoField.bool(abbreviation .. "." .. name, name, 8, nil, mask))
        end
    end
end

local function declare_message(message)
    for _, field in ipairs(message.fields) do
        declare("uav_relay." .. message.name:lower() .. "." .. field.name, field)
    end
end
for _, message in pairs(messages) do
    declare_message(message)
end
declare_message(handshake)
proto.fields = all

-- A body under way: what is refused ends it by an error whose text is the reason.
local function refuse(why)
    error({ why = why }, 0)
end

local function bytes(body, count)
    if body.at + count > body.ends then
        refuse("malformed")
    end
    local range = body.tvb(body.at, count)
    body.at = body.at + count
    return range
end

-- A postcard varint in its one form, and where it stands.
local function varint(body)
    local from, number, factor = body.at, 0, 1
    while true do
        local byte = bytes(body, 1):uint()
        if byte == 0 and factor > 1 or factor > 2 ^ 28 then
            refuse("malformed")
        end
        number = number + byte % 128 * factor
        if byte < 128 then
            return number, body.tvb(from, body.at - from)
        end
        factor = factor * 128
    end
end

local function flag(body)
    local range = bytes(body, 1)
    if range:uint() > 1 then
        refuse("malformed")
    end
    return range:uint() == 1, range
end

local read

local function several(tree, field, body, count)
    for number = 1, count do
        if field.of.kind == "group" then
            local from = body.at
            local branch = tree:add(body.tvb(from, 0), field.name .. " " .. number)
            read(branch, field.of, body)
            branch:set_len(body.at - from)
        else
            read(tree, field.of, body)
        end
    end
end

function read(tree, field, body)
    local kind = field.kind
    if kind == "group" then
        for _, inner in ipairs(field.fields) do
            read(tree, inner, body)
        end
    elseif kind == "array" then
        several(tree, field, body, field.size)
    elseif kind == "list" then
        local count, range = varint(body)
        tree:add(field.count, range, count)
        if count > field.most then
            refuse("malformed")
        end
        several(tree, field, body, count)
    elseif kind == "option" then
        local some, range = flag(body)
        if not some then
            tree:add(range, field.name .. ": none")
        elseif field.of.kind == "group" then
            local branch = tree:add(range, field.name)
            read(branch, field.of, body)
        else
            read(tree, field.of, body)
        end
    else
        local range
        if kind == "bool" then
            range = select(2, flag(body))
        else
            range = bytes(body, plain[kind][1])
        end
        local item = tree:add_le(field.made, range)
        if field.unit ~= "" then
            item:append_text(field.per and string.format(" x %s", field.unit) or " " .. field.unit)
        end
        if field.per then
            local number = (kind == "i24" or kind == "i32") and range:le_int() or range:le_uint()
            item:append_text(string.format(" = %.10g %s", number / field.per, field.base))
        elseif kind == "view" and range:le_uint() > 0 then
            local view = range:le_uint()
            item:append_text(string.format(" (%d by node %d)", math.floor(view / 1024), view % 1024))
        elseif kind == "flags" then
            for _, bit in ipairs(field.bits) do
                item:add(bit, range)
            end
        end
    end
end

-- CRC-32C, reflected. Whichever Lua it is has one of these.
local library = bit32 or bit
local xor = library and library.bxor or load("return function(a, b) return a ~ b end")()
local steps = {}
for byte = 0, 255 do
    local crc = byte
    for _ = 1, 8 do
        local low = crc % 2
        crc = math.floor(crc / 2)
        if low == 1 then
            crc = xor(crc, 0x82f63b78) % 2 ^ 32
        end
    end
    steps[byte] = crc
end

local function crc32c(tvb, count)
    local crc = 0xffffffff
    for at = 0, count - 1 do
        local byte = xor(crc % 256, tvb(at, 1):uint()) % 256
        crc = xor(math.floor(crc / 256), steps[byte]) % 2 ^ 32
    end
    return xor(crc, 0xffffffff) % 2 ^ 32
end

-- What stands before the delimiter without COBS, as a tvb, or why there is nothing.
local function unstuffed(tvb, from, ends, is_ended)
    if not is_ended then
        return nil, "unended"
    end
    local plain_bytes = {}
    local at = from
    while at < ends do
        local run = tvb(at, 1):uint()
        local left = math.min(run - 1, ends - at - 1)
        for more = 1, left do
            plain_bytes[#plain_bytes + 1] = tvb(at + more, 1):uint()
        end
        if #plain_bytes > MOST then
            return nil, "oversized"
        elseif left < run - 1 then
            return nil, "truncated"
        end
        at = at + run
        if at < ends and run < 255 then
            plain_bytes[#plain_bytes + 1] = 0
        end
    end
    if #plain_bytes > MOST then
        return nil, "oversized"
    elseif #plain_bytes < HEADER + CHECK then
        return nil, "short"
    end
    local array = ByteArray.new()
    array:set_size(#plain_bytes)
    for number, byte in ipairs(plain_bytes) do
        array:set_index(number - 1, byte)
    end
    return array:tvb("Frame without COBS")
end

local function header(tvb, tree, pinfo)
    local first, second = tvb(0, 2):le_uint(), tvb(2, 2):le_uint()
    local sender, destination = first % 4096, second % 4096
    local version, flags = math.floor(first / 4096), math.floor(second / 4096)
    if version ~= 1 or flags ~= 0 and flags ~= 1 and flags ~= 3 then
        refuse("version")
    end
    if flags > 0 and tvb:len() < HEADER + TAG + CHECK then
        refuse("short")
    end
    tree:add(head.version, tvb(1, 1), version)
    tree:add(head.sender, tvb(0, 2), sender)
    tree:add(head.flags, tvb(3, 1), flags)
    tree:add(head.destination, tvb(2, 2), destination)
    tree:add_le(head.network, tvb(4, 2))
    tree:add_le(head.counter, tvb(6, 4))
    pinfo.cols.src = tostring(sender)
    pinfo.cols.dst = tostring(destination)
    return flags
end

local function open(tvb, tree, pinfo)
    local ends = tvb:len() - CHECK
    local crc = tree:add_le(head.crc, tvb(ends, CHECK))
    local is = crc32c(tvb, ends)
    if tvb(ends, CHECK):le_uint() ~= is then
        crc:append_text(string.format(", but its bytes give 0x%08x", is))
        refuse("crc")
    end
    local flags = header(tvb, tree, pinfo)
    if flags > 0 then
        ends = ends - TAG
        tree:add(head.tag, tvb(ends, TAG))
    end
    local body = { tvb = tvb, at = HEADER, ends = ends }
    local message = handshake
    if flags < 2 then
        local tag = bytes(body, 1):uint()
        message = messages[tag] or refuse("unknown_tag")
    end
    tree:add(head.message, tvb(HEADER, flags < 2 and 1 or 0), message.name)
    pinfo.cols.info:append(message.name .. " ")
    local branch = tree:add(tvb(HEADER, ends - HEADER), message.name)
    for _, field in ipairs(message.fields) do
        read(branch, field, body)
    end
    if body.at < body.ends then
        refuse("malformed")
    end
end

-- The frame in a piece of a packet.
local function frame(tvb, from, ends, is_ended, tree, pinfo)
    local range = tvb(from, ends - from + (is_ended and 1 or 0))
    local branch = tree:add(proto, range)
    local without, why = unstuffed(tvb, from, ends, is_ended)
    if without then
        local opened, failure = pcall(open, without, branch, pinfo)
        if not opened then
            why = type(failure) == "table" and failure.why or error(failure, 0)
        end
    end
    if why then
        branch:add(head.refused, range, why)
        branch:add_proto_expert_info(wrong, "The frame is refused: " .. why)
        pinfo.cols.info:append("[refused: " .. why .. "] ")
    end
end

function proto.dissector(tvb, pinfo, tree)
    pinfo.cols.protocol = "UAV relay"
    pinfo.cols.info = ""
    local from = 0
    for at = 0, tvb:len() - 1 do
        if tvb(at, 1):uint() == 0 then
            if at > from then
                frame(tvb, from, at, true, tree, pinfo)
            end
            from = at + 1
        end
    end
    if from < tvb:len() then
        frame(tvb, from, tvb:len(), false, tree, pinfo)
    end
end

DissectorTable.get("wtap_encap"):add(wtap.USER0, proto)
